"""An arm guarded by the board's own firmware: emulated as compiled, its port a pseudo-terminal, its skin touched.

Whatever ends the frames, the arm stands and a line names it.
"""

import sys
from contextlib import contextmanager

import pytest

from coneskin.core.errors import Collision, RobotRefused
from coneskin.runs.replay.run import read_run
from coneskin.session.session import guard
from tests.support.firmware.emulated_board import BoardPrograms, EmulatedBoard
from tests.support.firmware.firmware_build import build_emulator, build_sketch, missing_tools
from tests.support.firmware.guarded_board import board_scene
from tests.support.scenes import START

from .guarded_session import DEADLINE, assert_stopped_on_the_way, fast, moving, until

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="the emulated board needs a pseudo-terminal"),
    pytest.mark.skipif(bool(missing_tools()), reason=missing_tools()),
]
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

BUSY = "no verdict: this computer is too busy for the emulator of a board"


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("firmware")
    return BoardPrograms(build_emulator(folder), build_sketch(folder))


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


@pytest.fixture
def board(programs, controller):
    with EmulatedBoard(programs, board_scene(controller.host, "none").sensors[0].sensor) as emulated:
        yield emulated


def too_slow(fault):
    """Tell whether a fault is that of an emulator that a busy computer lets run more slowly than the board."""
    return any(
        words in fault
        for words in ("the device's clock runs", "frames arrive too long after", "no valid frame has come")
    )


@contextmanager
def guarded(controller, board, folder=None):
    """Guard the arm, where the emulator keeps up with the time; each start has a recording of its own in a folder."""
    for number in range(3):
        recording = folder and folder / f"{number}.rec"
        session = guard(board_scene(controller.host, board.path), recording=recording)
        try:
            session.open()
        except RobotRefused as refused:
            if not too_slow(str(refused)):
                raise
            continue
        try:
            yield session
        finally:
            session.close()
        return
    pytest.skip(BUSY)


def test_a_touch_stops_the_arm_where_it_is_and_replays_bit_by_bit(controller, board, tmp_path):
    with guarded(controller, board, tmp_path) as session:
        thread, raised = moving(session)
        until(lambda: fast(controller) or has_fault(session))
        board.touch(0.13, 1.55, duration=0.4)
        thread.join(DEADLINE)
        if isinstance(raised[0], RobotRefused) and too_slow(str(raised[0])):
            pytest.skip(BUSY)
        assert isinstance(raised[0], Collision)
        assert raised[0].u == pytest.approx(0.13, abs=1e-3)
        assert_stopped_on_the_way(controller)
    assert read_run(session.recording).replay().same


def has_fault(session):
    return any(event.name == "fault" for event in session.events)


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        (("0 power off",), "no valid frame has come for too long: check power, cable"),
        (("0 power off", "0.1 power on"), "the device has started anew: check its power"),  # the supply dips for 0.1 s
        (("0 hang",), "the device has started anew: check its power and its firmware's watchdog"),
        (("0 supply 2.0",), "the device reports"),
        ((), "is gone: the other end closed it"),
    ],
    ids=["killed", "browned out", "watchdog fired", "supply sags", "unplugged"],
)
def test_whatever_happens_to_the_board_the_arm_stops_and_a_line_names_it(controller, board, lines, named):
    for _ in range(5):  # an emulator that a busy computer lets wait sends its frames too late, which is a fault before
        with guarded(controller, board) as session:
            thread, raised = moving(session)
            until(lambda now=session: fast(controller) or has_fault(now))
            if has_fault(session):
                thread.join(DEADLINE)
                continue
            if lines:
                board.tell(*lines)
            else:
                board.unplug()
            fault = session.wait_for(("fault",), DEADLINE)
            assert_stopped_on_the_way(controller)
            thread.join(DEADLINE)
            if named not in fault.details["what"] and too_slow(fault.details["what"]):
                continue  # it took the emulator longer to start anew than a board
            assert named in fault.details["what"]
            assert isinstance(raised[0], RobotRefused)
            assert named in str(raised[0])
            return
    pytest.skip(BUSY)
