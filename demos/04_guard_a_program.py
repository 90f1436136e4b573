"""A program moves a simulated UR5e under guard; its skin is touched; the program gets Collision and a person resets.

python demos/04_guard_a_program.py [HOST]      HOST: loopback address of the simulated controller
"""

import math
import sys
import threading

from coneskin.errors import Collision
from coneskin.robot.sim_process import SimulatedController
from coneskin.scene_reader import parse_scene
from coneskin.session import guard

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

[watch]
skin_silence_ms = 250
skin_late_ms = 250
arm_silence_ms = 250
"""


def rad(*degrees: float) -> list[float]:
    return [math.radians(angle) for angle in degrees]


HOME, GOAL = rad(-40, -90, 90, -90, -90, 0), rad(60, -80, 80, -90, -90, 0)


def main(host: str) -> None:
    scene = parse_scene(SCENE.format(host=host))
    # the silences in the scene are long because a busy machine can stall a pseudo-terminal; a real port needs 50 ms
    with SimulatedController("UR5e", host, HOME), guard(scene) as g:
        finger = threading.Timer(0.8, lambda: g.touch(u=0.130, phi=math.pi / 2, duration=0.2))
        finger.start()
        try:
            g.arm.move_j(GOAL, speed=0.8, acceleration=2.0)
            print("arrived, untouched")
        except Collision as exc:
            print(f"Collision: {exc}")
        finger.join()
        print("events: " + ", ".join(event.name for event in g.events))
        g.reset()  # because a person has looked
        g.arm.move_j(HOME, speed=1.5, acceleration=3.0)
        print("reset, and back home")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1")
