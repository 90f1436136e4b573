"""Guard a program: it moves a simulated UR5e whose skin is touched, gets Collision, and resets the guard.

python demos/04_guard_a_program.py [HOST]      HOST: loopback address of the simulated controller
"""

import math
import sys
import threading

import coneskin as cs

SCENE = """
[arm]
model = "UR5e"
host = "{host}"

[[link]]
name = "forearm"

[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
xyz_mm = [0, 0, 80]

[source]
kind = "virtual"

[reaction]
kind = "retreat"
distance_mm = 30
bare_side = "fast"   # what has no skin leads in the retreat, and nothing is there in this simulation

[monitoring]
skin_silence_ms = 1000
arm_silence_ms = 1000
program_silence_ms = 1000
"""


def rad(*degrees: float) -> list[float]:
    return [math.radians(angle) for angle in degrees]


HOME, GOAL = rad(-40, -90, 90, -90, -90, 0), rad(60, -80, 80, -90, -90, 0)


def main(host: str) -> None:
    scene = cs.parse_scene(SCENE.format(host=host))
    # the arm retreats only if the skin reads touches where they are; a real one: `coneskin commission scene.toml`
    scene = cs.commission_virtual_skin(scene)
    # the limits of silence are long because a busy machine can stall a pseudo-terminal; a real port needs 50 ms
    with cs.SimulatedController("UR5e", host, HOME), cs.guard(scene) as session:
        finger = threading.Timer(0.8, lambda: session.touch(u=0.130, phi=math.pi / 2, duration=0.15))
        finger.start()
        try:
            session.arm.move_j(GOAL, speed=0.8, acceleration=2.0)
            print("arrived without a touch")
        except cs.Collision as collision:
            print(f"Collision: {collision}")
        finger.join()
        session.wait_for((cs.EventName.TOUCH_ENDED,), timeout=10.0)  # a touched skin refuses a reset
        print("events: " + ", ".join(event.name for event in session.events))
        session.reset()  # because a person has looked
        session.arm.move_j(HOME, speed=1.5, acceleration=3.0)
        print("after the reset: back home")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1")
