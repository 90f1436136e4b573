"""What the tests with real processes share: a UR5e with one sensor on its forearm, moving, guarded."""

import os
import signal
import threading
import time

from coneskin.scene.reader import parse_scene
from coneskin.testing.scenes import GOAL, commissioned, forearm_scene

_PATIENT = "skin_silence_ms = 1000\nskin_late_ms = 1000\narm_silence_ms = 300\nprogram_silence_ms = 500"


def scene_text(host, changes=None, control="internal"):
    """The text of a scene, with some of it replaced: old -> new.

    Its silences are long: the machine that runs the tests may stall a pseudo-terminal. The limits themselves are tested
    in virtual time (test_guard_core).
    """
    text = forearm_scene(host, control, reaction='kind = "retreat"\ndistance_mm = 30', limits=_PATIENT)
    for old, new in (changes or {}).items():
        assert old in text, old
        text = text.replace(old, new)
    return text


def scene_for(simulated, changes=None, control="internal"):
    return commissioned(parse_scene(scene_text(simulated.host, changes, control)))


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
    state = simulated.wait_for_standstill()
    assert state["q"][0] < GOAL[0] - 0.1, "the arm went on to its goal"


def kill(session, name, number=signal.SIGKILL):
    os.kill(session._processes.children[name].pid, number)
