"""What the tests with real processes share: a UR5e with one sensor on its forearm, moving, guarded."""

import math
import os
import signal
import threading
import time

from coneskin.scene_reader import parse_scene

START = [math.radians(q) for q in (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
GOAL = [math.radians(60.0), *START[1:]]
_SCENE = """\
[arm]
model = "UR5e"
host = "{host}"
control = "{control}"
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
xyz_mm = [0, 0, 80]
[source]
{source}
[reaction]
{reaction}
"""
_PATIENT = "skin_silence_ms = 400\nskin_late_ms = 400\narm_silence_ms = 300"


def forearm_scene(
    host="127.0.0.1",
    control="owner",
    port="",
    reaction='kind = "stop"\ndeceleration_rad_s2 = 10',
    watch="",
):
    """The text of a scene; the benches use it too.

    Args:
        host: of the controller.
        control: "owner" or "foreign".
        port: of the skin's bytes; a virtual skin where it is empty.
        reaction: lines of [reaction].
        watch: lines of [watch]; the limits that are not named have their defaults.
    """
    source = f'kind = "serial"\nport = "{port}"' if port else 'kind = "virtual"'
    text = _SCENE.format(host=host, control=control, source=source, reaction=reaction)
    return text + (f"[watch]\n{watch}\n" if watch else "")


def scene_text(host, changes=None, control="owner"):
    """The text of a scene, with some of it replaced: old -> new.

    Its silences are long: the machine that runs the tests may stall a pseudo-terminal. The limits themselves are tested
    in virtual time (test_guard_core).
    """
    text = forearm_scene(host, control, reaction='kind = "retreat"\ndistance_mm = 30', watch=_PATIENT)
    for old, new in (changes or {}).items():
        assert old in text, old
        text = text.replace(old, new)
    return text


def scene_for(simulated, changes=None, control="owner"):
    return parse_scene(scene_text(simulated.host, changes, control))


def moving(session):
    """Start the long move from a thread; what it raised is in the list that is returned."""
    raised = []

    def move():
        try:
            session.arm.move_j(GOAL, speed=1.0, acceleration=4.0)
            raised.append(None)
        except Exception as exc:
            raised.append(exc)

    thread = threading.Thread(target=move)
    thread.start()
    return thread, raised


def until(what, seconds=20.0):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)


def fast(simulated):
    return max(map(abs, simulated.state()["qd"])) > 0.9


def run_until_moving(simulated, session):
    thread, raised = moving(session)
    until(lambda: fast(simulated))
    return thread, raised


def assert_stopped_on_the_way(simulated):
    state = simulated.wait_standing()
    assert state["q"][0] < GOAL[0] - 0.1, "the arm went on to its goal"


def kill(session, name, number=signal.SIGKILL):
    os.kill(session._children[name].pid, number)
