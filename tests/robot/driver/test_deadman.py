"""Deadman of a process whose library may block it: it beats for work only, and ends what is left alone."""

import subprocess
import sys

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.robot.driver.deadman import Deadman
from coneskin.robot.driver.messages import StatusReport

ALIVE = StatusReport("alive").encode()


@pytest.fixture
def ends():
    (ours, theirs), (other, far) = ((Channel(a), Channel(b)) for a, b in (pair(), pair()))
    yield ours, theirs, other, far
    for channel in (ours, theirs, other, far):
        channel.close()


@pytest.fixture
def now():
    return [10.0]


@pytest.fixture
def ended():
    return []


@pytest.fixture
def deadman(ends, now, ended):
    return Deadman(ends[0], ends[2], clock=lambda: now[0], end=lambda: ended.append(now[0]))


def test_it_beats_while_the_process_gets_on_and_no_longer(deadman, ends, now):
    deadman.work()
    deadman.poll()
    assert ends[1].receive() == [ALIVE]
    now[0] += 0.2
    deadman.poll()
    assert ends[1].receive() == []  # the process hangs
    deadman.work(2.0)  # a call that may take long
    now[0] += 2.05
    deadman.poll()
    assert ends[1].receive() == [ALIVE]
    now[0] += 0.1
    deadman.poll()
    assert ends[1].receive() == []


@pytest.mark.promise("P49")
@pytest.mark.parametrize("side", [1, 3])
def test_when_a_channel_has_ended_the_process_does_within_its_last_while(deadman, ends, now, ended, side):
    ends[side].send(b"not read yet")
    ends[side].close()
    for _ in range(16):
        deadman.work(100.0)
        deadman.poll()
        now[0] += 0.1
    assert ended == []
    deadman.poll()
    assert ended == [pytest.approx(11.6)]


def test_a_process_that_is_about_to_end_does(deadman, now, ended):
    deadman.end_soon()
    now[0] += 1.0
    deadman.end_soon()  # no new while
    now[0] += 0.6
    deadman.poll()
    assert ended


@pytest.mark.promise("P49")
@pytest.mark.long
@pytest.mark.parametrize("keeps_lock", [True, False])
def test_a_process_that_a_library_has_frozen_ends_all_the_same(keeps_lock):
    """With and without Python's lock: ``sleep`` through PyDLL keeps it, through CDLL does not."""
    code = (
        "import ctypes, sys, time\n"
        "from coneskin.core.child_process import inherit\n"
        "from coneskin.robot.driver.deadman import Deadman\n"
        "lifeline, (guard,) = inherit(sys.argv[1:])\n"
        "lifeline.hold()\n"
        "with Deadman(guard) as deadman:\n"
        "    deadman.work()\n"
        "    time.sleep(0.5)\n"
        "    guard.send(b'blocked')\n"
        f"    ctypes.{'PyDLL' if keeps_lock else 'CDLL'}(None).sleep(300)\n"
    )
    ours, theirs = pair()
    guard = Channel(ours)
    child = subprocess.Popen([sys.executable, "-c", code, "1", str(theirs.fileno())], pass_fds=[theirs.fileno()])
    theirs.close()
    try:
        said = []
        while b"blocked" not in said:
            said += guard.receive()
            assert child.poll() is None
        guard.close()
        assert child.wait(60.0) == 1
    finally:
        child.kill()
        child.wait()
