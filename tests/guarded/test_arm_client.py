"""What a program can do with the arm, with real processes: every kind of motion and its end by a touch."""

import math
import threading
import time

import pytest

from coneskin.core.errors import Collision, RobotRefused
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.sim.urscript.values import values_of
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import DEADLINE, await_message, is_reset, scene_for, until

pytestmark = pytest.mark.long
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

TOOL = list(values_of(forward(arm_model("UR5e"), START)))


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


@pytest.fixture
def session(controller):
    changes = {
        'kind = "retreat"\ndistance_mm = 30': 'kind = "stop"\ndeceleration_rad_s2 = 8',
        "program_silence_ms = 1500": "program_silence_ms = 3000",
    }
    with guard(scene_for(controller, changes)) as session:
        yield session


def let_move(session):
    """Reset the stop for a touch, and go back to the start; again where a busy computer has stopped that."""
    until(lambda: is_let_go(session))
    until(lambda: is_reset(session) and is_back(session))


def is_back(session):
    try:
        session.arm.move_j(START, 2.0, 8.0)
    except RobotRefused:
        return False
    return True


def ahead(metres):
    """The tool's pose at the start, this much further along x."""
    return [TOOL[0] + metres, *TOOL[1:]]


def stream(send):
    """Send a command again and again, until it raises."""

    def run(arm):
        for step in range(6000):  # a minute
            send(arm, step * 0.01)
            time.sleep(0.01)

    return run


FAR = [START[0] + 1.8, *START[1:]]
HALF = [START[0] + 0.9, *START[1:]]
MOTIONS = {
    "move_j": lambda arm: arm.move_j(FAR, 0.8, 8.0),
    "move_j_ik": lambda arm: arm.move_j_ik(values_of(forward(arm_model("UR5e"), FAR)), 0.8, 8.0),
    "move_l": lambda arm: arm.move_l(ahead(-0.25), 0.1, 3.0),
    "joint path": lambda arm: arm.move_path([Waypoint.move_j(HALF, 0.8, 8.0, 0.05), Waypoint.move_j(FAR, 0.8, 8.0)]),
    "straight path": lambda arm: arm.move_path(
        [Waypoint.move_l(ahead(-0.1), 0.1, 3.0, 0.02), Waypoint.move_l(ahead(-0.25), 0.1, 3.0)]
    ),
    "speed_j": stream(lambda arm, _: arm.speed_j([0.4, 0, 0, 0, 0, 0], 4.0, 0.3)),
    "speed_l": stream(lambda arm, _: arm.speed_l([-0.05, 0, 0, 0, 0, 0], 1.0, 0.3)),
    "servo_j": stream(lambda arm, t: arm.servo_j([START[0] + 0.3 * t, *START[1:]], 0.3)),
    "servo_l": stream(lambda arm, t: arm.servo_l(ahead(-0.04 * t), 0.3)),
}


def drive(motion, arm):
    """Run a motion in a thread; what it raised is in the list that is returned."""
    raised = []

    def run():
        try:
            motion(arm)
        except Exception as exc:
            raised.append(exc)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, raised


def has_moved(controller, before):
    return lambda: math.dist(controller.state()["q"], before) > 0.02


def is_let_go(session):
    names = [event.name for event in session.events if event.name in ("contact", "touch_ended")]
    return names[-1] == "touch_ended"


@pytest.mark.promise("P05")
def test_a_touch_in_the_middle_of_each_kind_of_motion_ends_in_a_measured_standstill(controller, session):
    for name, motion in MOTIONS.items():
        before = controller.state()["q"]
        thread, raised = drive(motion, session.arm)
        until(has_moved(controller, before))
        session.touch(0.13, 1.55, duration=0.1)
        thread.join(DEADLINE)
        assert [type(exc) for exc in raised] == [Collision], (name, raised)
        assert raised[0].standstill_confirmed, name
        stood = controller.state()
        assert max(map(abs, stood["qd"])) == 0.0, name
        with pytest.raises(Collision):
            session.arm.outputs.set_digital(0, True)
        until(lambda: is_let_go(session))
        assert controller.state()["q"] == stood["q"], f"{name} went on by itself"
        let_move(session)


def test_moves_go_on_beside_the_program_which_follows_them_waits_for_them_and_stops_them(controller, session):
    arm = session.arm
    points = [Waypoint.move_j([START[0] + 0.1 * n, *START[1:]], 0.2, 8.0, 0.02) for n in (1, 2, 3)]
    began = time.monotonic()
    arm.move_path([*points, Waypoint.move_l(TOOL, 0.2, 3.0)], wait=False)
    seen = [arm.progress()]
    while (waypoint := arm.progress()) is not None:
        seen.append(waypoint)
        time.sleep(0.002)
    assert time.monotonic() - began > 0.3, "it cannot have been driven"
    assert seen == sorted(seen)
    assert seen[0] == 0
    assert 2 <= len(set(seen)) <= 4  # a busy computer may look too seldom to see each; test_program_request does
    assert controller.wait_for_standstill()["q"] == pytest.approx(START, abs=1e-4)  # the wheel writes 6 digits
    assert arm.progress() is None
    arm.wait()  # nothing to wait for

    arm.move_j(FAR, 0.5, 4.0, wait=False)
    thread, raised = drive(lambda it: it.wait(), arm)
    until(fast_enough(controller))
    arm.stop(8.0)
    thread.join(DEADLINE)
    assert "wait: the program itself has stopped the arm" in str(raised[0])
    assert controller.wait_for_standstill()["q"][0] < FAR[0] - 0.5
    arm.moveL_FK(START, 0.5, 3.0)
    assert controller.state()["q"] == pytest.approx(START, abs=1e-3)


def fast_enough(controller):
    return lambda: max(map(abs, controller.state()["qd"])) > 0.2


STREAMS = {
    "speed_j": lambda arm: arm.speed_j([0.4, 0, 0, 0, 0, 0], 4.0),
    "servo_j": lambda arm: arm.servo_j([START[0] + 0.3, *START[1:]], 0.2),
    "servo_l": lambda arm: arm.servo_l(ahead(-0.1), 0.1, gain=100),
    "speedL of ur_rtde": lambda arm: arm.speedL([-0.2, 0, 0, 0, 0, 0], 3.0),
}


@pytest.mark.promise("P51")
def test_a_program_that_falls_silent_does_not_move_its_arm_on(controller, session):
    """Its main thread hangs, or forgets; its heartbeat goes on."""
    for name, command in STREAMS.items():
        began = len(session.events)
        moved = has_moved(controller, controller.state()["q"])
        while not moved():  # one that has waited for longer than it holds moves nothing
            command(session.arm)
            time.sleep(0.02)  # each look costs the controller something
        state = controller.wait_for_standstill()
        assert max(map(abs, state["qd"])) == 0.0, name
        await_message(session, "no new speed or servo command", began)
        session.arm.move_j(START, 2.0, 8.0)  # no stop of the guard: the program may go on


@pytest.mark.promise("P06")
def test_a_touch_while_a_path_is_taken_stops_it_as_soon_as_it_moves(controller, session):
    """The program is sent, which takes 0.1 s: on a busy computer the touch comes later, and is repeated."""
    for _ in range(20):
        before = controller.state()["q"]
        thread, raised = drive(MOTIONS["joint path"], session.arm)
        until(lambda: not session.arm.states.reading().program_running)
        session.touch(0.13, 1.55, duration=0.4)
        thread.join(DEADLINE)
        assert isinstance(raised[0], Collision)
        assert raised[0].standstill_confirmed
        moved = math.dist(controller.wait_for_standstill()["q"], before)
        if moved < 0.02:
            return
        let_move(session)
    pytest.fail(f"it has moved by {moved:.3f} rad")


def test_outputs_are_set_states_are_read_and_questions_are_answered(controller, session):
    arm = session.arm
    arm.outputs.set_digital(3, True)
    arm.outputs.set_digital(1, True, "configurable")
    arm.outputs.set_digital(0, True, "tool")
    arm.outputs.set_analog(1, 0.25)
    arm.outputs.set_register(19, 7)
    arm.setInputDoubleRegister(20, 2.5)
    until(lambda: arm.states.reading().digital_outputs == 1 << 3 | 1 << 9 | 1 << 16)
    arm.setStandardDigitalOut(3, False)
    until(lambda: not arm.getDigitalOutState(3))
    reading = arm.states.reading()
    assert [reading.digital_output(n, group) for n, group in ((3, "standard"), (1, "configurable"), (0, "tool"))] == [
        *(False, True, True)
    ]
    assert reading.analog_outputs == (0.0, 2.5)  # V
    assert reading.q == pytest.approx(arm.getActualQ())
    assert (reading.mode, reading.safety_mode, reading.speed_fraction) == ("RUNNING", "NORMAL", 1.0)
    assert (reading.program_running, arm.isProtectiveStopped(), arm.isSteady()) == (True, False, True)
    assert (arm.states.value("input_int_register_19"), arm.states.value("input_double_register_20")) == (7, 2.5)
    pose = arm.getActualTCPPose()
    assert arm.getForwardKinematics(arm.getActualQ()) == pytest.approx(pose, abs=1e-6)
    assert arm.ask("getInverseKinematics", pose) == pytest.approx(list(reading.q), abs=1e-6)
    with pytest.raises(RobotRefused, match="forceMode is refused: in it the arm moves with what pushes it"):
        arm.forceMode([0.0] * 6, [0] * 6, [0.0] * 6, 2, [0.1] * 6)
    for wrong in (lambda: arm.setToolDigitalOut(2, True), lambda: arm.outputs.set_analog(0, 1.5)):
        with pytest.raises(ValueError, match="number"):
            wrong()
    assert controller.state()["q"] == list(reading.q)
