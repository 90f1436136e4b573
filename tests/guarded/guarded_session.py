"""What the tests with real processes share: a UR5e with one sensor on its forearm, moving, guarded.

None of them asks how soon something happens: what is late is tested in virtual time. They wait for events, and their
scenes are patient. Two limits of the product are not theirs to set, those of a motion away: an arm is moved away only
by what was measured within 50 ms, and the driver process follows only a guard that is heard every 100 ms. Where the
computer is busier than that the arm rightly stops, and says so. ``until_undisturbed`` then tries again.
"""

import math
import os
import re
import signal
import threading
import time
from pathlib import Path

import pytest

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.arm.models import UR_CURRENTS
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.reaction.types import ContactOnLink
from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from tests.support.scenes import START, commissioned, forearm_scene

DEADLINE = 60.0  # s for whatever has to happen; a busy computer takes its time
FAR = [math.radians(300.0), *START[1:]]  # a goal that takes 6 s, longer than any silence that a scene here lets be

PATIENT = "skin_silence_ms = 1000\narm_silence_ms = 1000\nprogram_silence_ms = 1500\nescalate_ms = 250"
#: what a guard says where this computer has held it up in a motion away
_HELD_UP = ("too old to move away by", "too late to move away by", "the guard has been silent for")
#: ... and where it touched the arm so late that no way was left, or let it move away so late that its time was used up
_HELD_UP += ("no retreat: a point of the arm has moved", "the time of 2.0 s is over")
#: ... and where the simulated skin was told so late that the arm moves away that its touch had not become lighter
_HELD_UP += ("the touch does not become lighter, though",)
#: ... and where the bytes of a skin that this computer simulates came later than its patient scene allows
_HELD_UP += ("ms late, skin_silence_ms = 1000; a busy computer needs more",)
TOO_BUSY = 3.0 * (os.cpu_count() or 1)  # processes that want to run, on average: so many leave none of them punctual


def scene_text(host, changes=None, control="internal"):
    """The text of a scene, with some of it replaced: old -> new.

    Its silences are long: the machine that runs the tests may stall a pseudo-terminal. The limits themselves are tested
    in virtual time (test_guard_core).
    """
    text = forearm_scene(host, control, reaction='kind = "retreat"\ndistance_mm = 30', limits=PATIENT)
    text = text.replace("[reaction]", '[reaction]\nbare_side = "fast"')
    text = text.replace("[arm]", "[arm]\nwatchdog_hz = 1")
    for old, new in (changes or {}).items():
        assert old in text, old
        text = text.replace(old, new)
    return text


def scene_for(simulated, changes=None, control="internal"):
    return commissioned(parse_scene(scene_text(simulated.host, changes, control)))


def moving(session, goal=FAR):
    """Start a long move from a thread; what it raised is in the list that is returned."""
    raised = []

    def move():
        try:
            session.arm.move_j(goal, speed=1.0, acceleration=4.0)
            raised.append(None)
        except Exception as exc:
            raised.append(exc)

    thread = threading.Thread(target=move)
    thread.start()
    return thread, raised


def turn_base(controller, session):
    """Let the base turn at 0.5 rad/s: a command that has waited for longer than it holds moves nothing."""
    while controller.state()["qd"][0] < 0.45:
        session.arm.speed_j([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0, duration=10.0)
        time.sleep(0.1)


def push_joints(controller, scene, u=0.13, phi=1.55, force=100.0):
    """Let the joints feel a push on the scene's first skin [N]: what touches a virtual skin does not reach them."""
    at = place_on_arm(scene)[0]
    turns = _push_torque(at.model, tuple(controller.state()["q"]), ContactOnLink(at.link, *at.place(u, phi)))
    currents = (-force * turn / each for turn, each in zip(turns, UR_CURRENTS.torque_per_ampere, strict=True))
    controller.call("resist " + " ".join(f"{current:.4f}" for current in currents))


def until(what, seconds=DEADLINE):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.02)  # each look costs the controller something


def await_message(session, words, after=0):
    """Wait for a message with these words; a busy computer has others to tell of. Returns the position after it."""
    while True:
        message = session.wait_for(("message",), DEADLINE, after)
        assert message is not None, f"nothing was said of {words!r}"
        after = session.events.index(message) + 1
        if words in message.details["what"]:
            return after


def until_undisturbed(attempt):
    """Make attempts, each in a fresh session, until one gives something that no hold-up of this computer has ended.

    Skips the test where none does, and far more processes want to run than there are cores.

    Args:
        attempt: returns the guard's events, or its lines.
    """
    end = time.monotonic() + 3.0 * DEADLINE
    while True:
        events = attempt()
        said = " ".join(str(getattr(event, "details", event)) for event in events)
        if not any(words in said for words in _HELD_UP):
            return events
        if time.monotonic() > end and os.getloadavg()[0] > TOO_BUSY:
            pytest.skip("no verdict: this computer is too busy for any arm to be moved away")
        assert time.monotonic() < end, "no arm is moved away: " + said


def is_reset(session):
    """Reset the newest stop, and say whether that was taken: what was late may have to become quiet again."""
    try:
        session.reset(timeout=DEADLINE)
    except (RobotRefused, RobotConnectionError):
        return False
    return True


def refusal(scene, words):
    """Why a guard does not become active: with more and more time to start in, until these words are in it."""
    for seconds in (3.0, 12.0, DEADLINE):
        with pytest.raises(RobotRefused) as refused:
            guard(scene, start_timeout=seconds).__enter__()
        if words in str(refused.value):
            break
    return str(refused.value)


def fast(simulated):
    return max(map(abs, simulated.state()["qd"])) > 0.9


def run_until_moving(simulated, session, goal=FAR):
    thread, raised = moving(session, goal)
    until(lambda: fast(simulated))
    return thread, raised


def assert_stopped_on_the_way(simulated):
    state = simulated.wait_for_standstill()
    assert state["q"][0] < FAR[0] - 0.1, "the arm went on to its goal"


def assert_short_slices(session, *names):
    """Processes of a guard are let in soon: every thread of theirs has short time slices, where the kernel tells."""
    for name in names:
        for task in Path(f"/proc/{session._processes.children[name].pid}/task").glob("*"):
            try:
                told = re.search(r"se\.slice *: *(\d+)", (task / "sched").read_text())
            except OSError:  # that thread has just ended
                continue
            assert told is None or int(told[1]) == 100_000, name


def kill(session, name, number=signal.SIGKILL):
    os.kill(session._processes.children[name].pid, number)
