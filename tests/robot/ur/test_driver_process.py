"""Driver process on a mocked arm: the guard comes first, and the arm is stopped when either side ends."""

import json
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.channel import Channel, decode_json, encode_json, pair
from coneskin.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.messages import (
    HEARTBEAT_TIMEOUT,
    SETPOINT_TIMEOUT,
    EndReaction,
    Heartbeat,
    Release,
    SetJointVelocity,
    Shutdown,
    StatusReport,
    StopProgram,
    decode_command,
)
from coneskin.robot.driver.waypoint import Waypoint
from coneskin.robot.ur.control_program import rtde_errors
from coneskin.robot.ur.driver_process import DriverProcess
from coneskin.robot.ur.ur_rtde import Mode, UrArm

finite = st.floats(allow_nan=False)


@given(
    st.one_of(
        st.builds(StopProgram, finite),
        st.builds(EndReaction, finite),
        st.builds(Release, st.integers(0, 2**64 - 1)),
        st.sampled_from([Heartbeat(), Shutdown()]),
        st.builds(SetJointVelocity, st.tuples(*[finite] * 6), finite),
    )
)
def test_commands_survive_the_wire(command):
    back = decode_command(command.encode())
    assert back == command
    assert type(back) is type(command)


@given(st.binary(max_size=80))
def test_nonsense_is_refused(message):
    try:
        command = decode_command(message)
    except ValueError:
        return
    assert command.encode() == message or message[:1] in b"VSHC"


class FakeWheel:
    """RTDEControlInterface as far as UrArm uses it; notes every call."""

    def __init__(self, accepts=True):
        self.calls = []
        self.accepts = accepts
        self.running = False
        self.playing = True

    def isProgramRunning(self):
        return self.playing

    def reuploadScript(self):
        self.playing = True
        return self._note("reuploadScript")

    def setWatchdog(self, frequency):
        return self._note("setWatchdog", frequency)

    def _note(self, name, *values):
        self.calls.append((name, *values))
        return self.accepts

    def moveJ(self, q, v, a, asynchronous):
        assert asynchronous  # during a synchronous move the wheel cannot deliver a stop
        self.running = True
        return self._note("moveJ", v, a)

    def moveL(self, pose, v, a, asynchronous):
        assert asynchronous
        return self._note("moveL", v, a)

    def moveJ_IK(self, pose, v, a, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("moveJ_IK", v, a)

    def moveL_FK(self, q, v, a, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("moveL_FK", v, a)

    def movePath(self, path, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("movePath", *path.entries)

    def speedL(self, twist, a, t):
        assert t == 0.002
        return self._note("speedL", a, twist[0])

    def servoL(self, pose, *rest):
        return self._note("servoL", *rest)

    def getTCPOffset(self):
        return [0.0] * 6

    def getForwardKinematics(self, *values):
        self._note("getForwardKinematics", *values)
        return [0.5] * 6

    def setTcp(self, pose):
        return self._note("setTcp", *pose)

    def setPayload(self, mass, centre):
        return self._note("setPayload", mass, *centre)

    def speedJ(self, qd, a, t):
        assert t == 0.002  # a new target in the next cycle
        return self._note("speedJ", a, qd[0])

    def servoJ(self, q, *rest):
        return self._note("servoJ")

    def stopJ(self, a):
        self.running = False
        self._note("stopJ", a)

    def speedStop(self, a):
        self._note("speedStop", a)

    def servoStop(self, a):
        self._note("servoStop", a)

    def kickWatchdog(self):
        self._note("kick")

    def getAsyncOperationProgressEx(self):
        running = self.running

        class Status:
            def isAsyncOperationRunning(self):
                return running

            def progress(self):
                return 2

        return Status()


class FakePath:
    """Path of the wheel's module."""

    def __init__(self):
        self.entries = []

    def addEntry(self, entry):
        self.entries.append(entry)


class FakeEntry:
    """PathEntry of the wheel's module."""

    MoveJ, MoveL, MoveP, PositionTcpPose, PositionJoints = "movej", "movel", "movep", "pose", "joints"

    def __new__(cls, kind, position, values):
        return (kind, position, values[6:])


def arm(accepts=True):
    made = UrArm("test", 4.0)
    made._program.wheel = SimpleNamespace(Path=FakePath, PathEntry=FakeEntry)
    made._program.control = FakeWheel(accepts)
    return made


def stops(wheel):
    return [call[0] for call in wheel.calls if call[0] not in ("kick", "setWatchdog")]


@pytest.mark.parametrize(
    ("start", "stop"),
    [
        (lambda a: a.move_j([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_l([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_j_ik([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_l_fk([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_path([Waypoint.move_j([0.0] * 6)]), "stopJ"),
        (lambda a: a.speed_j([0.0] * 6, 1.0), "speedStop"),
        (lambda a: a.speed_l([0.0] * 6, 1.0), "speedStop"),
        (lambda a: a.servo_j([0.0] * 6), "servoStop"),
        (lambda a: a.servo_l([0.0] * 6), "servoStop"),
    ],
)
def test_each_mode_has_its_own_stop(start, stop):
    a = arm()
    start(a)
    a.stop(5.0)
    assert stops(a._program.control)[-1] == stop
    assert a.mode is Mode.IDLE


def test_no_motion_starts_on_a_live_thread_of_another_kind():
    a = arm()
    a.move_j([0.0] * 6, 1.0, 1.0)
    a.speed_j([0.0] * 6, 1.0)
    a.servo_j([0.0] * 6)
    a.move_l([0.0] * 6, 1.0, 1.0)
    assert stops(a._program.control) == ["moveJ", "stopJ", "speedJ", "speedStop", "servoJ", "servoStop", "moveL"]
    a._program.control.calls.clear()
    a.speed_l([0.0] * 6, 1.0)
    a.speed_j([0.0] * 6, 1.0)  # one thread of the wheel's program does both
    a.servo_l([0.0] * 6)
    a.speed_l([0.0] * 6, 1.0)
    a.move_path([Waypoint.move_l([0.0] * 6)])
    a.servo_j([0.0] * 6)
    assert stops(a._program.control) == [
        *("stopJ", "speedL", "speedJ", "speedStop", "servoL", "servoStop", "speedL", "speedStop"),
        *("movePath", "stopJ", "servoJ"),
    ]


def test_what_the_wheel_refuses_is_an_error():
    a = arm(accepts=False)
    with pytest.raises(RobotRefused, match="did not take moveJ: its program is not running"):
        a.move_j([0.0] * 6, 1.0, 1.0)
    assert a.mode is Mode.IDLE
    with pytest.raises(RobotConnectionError, match="stopping: broken"), rtde_errors("stopping"):
        raise RuntimeError("broken")


@pytest.mark.parametrize(
    "start",
    [
        lambda a: a.move_j([0.0] * 6, 1.0, 1.0),
        lambda a: a.speed_j([0.0] * 6, 1.0),
        lambda a: a.servo_j([0.0] * 6),
    ],
)
def test_tool_and_payload_are_set_only_while_nothing_moves(start):
    a = arm()
    start(a)
    for setter in (lambda: a.set_tcp([0.1] * 6), lambda: a.set_payload(1.0, [0.0] * 3)):
        with pytest.raises(RobotRefused, match="must wait until the arm has arrived or was stopped"):
            setter()
    a.stop(5.0)
    a.set_tcp([0.1] * 6)
    a.set_payload(1.5, [0.0, 0.0, 0.04])
    assert a._program.control.calls[-2:] == [("setTcp", *[0.1] * 6), ("setPayload", 1.5, 0.0, 0.0, 0.04)]
    a._program.control.accepts = False
    with pytest.raises(RobotRefused, match="did not take setPayload"):
        a.set_payload(1.0, [0.0] * 3)


@pytest.fixture
def now():
    """Return the driver's clock, to be set."""
    return [10.0]


@pytest.fixture
def driver(now):
    made = arm()
    (guard, guard_end), (program, program_end) = ((Channel(s) for s in pair()) for _ in range(2))
    served = DriverProcess(made, guard_end, program_end, lambda: now[0])
    yield served, made, guard, program
    for channel in (guard, guard_end, program, program_end):
        channel.close()


def ask(program, **request):
    program.send(encode_json({"number": 1, "sent": 10.0, **request}))


def answers(channel):
    return [decode_json(message) for message in channel.receive()]


def move(program, sent=10.0):
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=2.0, sent=sent)


def test_the_program_is_refused_until_the_guard_clears_it(driver):
    served, made, guard, program = driver
    move(program)
    assert served.step(0.0)
    assert answers(program)[0]["stopped"] is True
    assert "moveJ" not in stops(made._program.control)
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    assert stops(made._program.control) == ["moveJ"]


def test_a_stop_comes_before_what_the_program_asked_and_ends_its_wait(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    assert answers(program) == []  # it waits for the end of the move
    move(program)
    guard.send(StopProgram(9.0).encode())
    served.step(0.0)
    assert stops(made._program.control) == ["moveJ", "stopJ"]
    assert [answer["stopped"] for answer in answers(program)] == [True, True]
    assert StatusReport("done").encode() in guard.receive()


def test_the_end_of_a_move_is_told(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    made._program.control.running = False
    served.step(0.0)
    assert answers(program) == [{"number": 1, "ok": True}]


def test_a_tool_is_set_for_the_program_unless_the_guard_forbids_it(driver):
    served, made, guard, program = driver
    ask(program, do="set_tcp", pose=[0.1] * 6)
    served.step(0.0)
    assert answers(program)[0]["stopped"] is True
    guard.send(Release(7).encode())
    ask(program, do="set_tcp", pose=[0.1] * 6)
    ask(program, do="set_payload", mass=2.0, centre=[0.0] * 3, number=2)
    served.step(0.0)
    assert answers(program) == [{"number": 1, "ok": True}, {"number": 2, "ok": True}]
    assert stops(made._program.control) == ["setTcp", "setPayload"]
    ask(program, do="move_j_ik", pose=[0.1] * 6, speed=1.0, acceleration=2.0, number=3)
    ask(program, do="set_tcp", pose=[0.2] * 6, number=4)
    served.step(0.0)
    (refused,) = answers(program)
    assert (refused["number"], refused["ok"], refused["stopped"]) == (4, False, False)
    assert stops(made._program.control)[-1] == "moveJ_IK"


def test_a_retreat_and_its_halt(driver):
    served, made, guard, _ = driver
    guard.send(SetJointVelocity((0.1, 0, 0, 0, 0, 0), 2.0).encode())
    served.step(0.0)
    guard.send(EndReaction(8.0).encode())
    served.step(0.0)
    assert stops(made._program.control) == ["speedJ", "speedStop"]


@pytest.mark.parametrize("side", ["guard", "program"])
def test_when_either_side_ends_the_arm_is_stopped(driver, side):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    (guard if side == "guard" else program).close()
    served.run()
    assert stops(made._program.control)[-1] == "stopJ"


def test_an_error_of_the_wheel_goes_to_the_guard(driver):
    served, made, guard, _ = driver
    made._program.control.accepts = False
    guard.send(SetJointVelocity((0.1, 0, 0, 0, 0, 0), 2.0).encode())
    served.step(0.0)
    notes = [StatusReport.decode(message) for message in guard.receive()]
    assert notes[0].kind == "error"
    assert "speedJ" in notes[0].text


@pytest.mark.parametrize(
    "request_", [{"do": "dance"}, {"do": "move_j"}, {"do": "move_j", "q": 1}, {}, {"do": "speed_j", "qd": []}]
)
def test_a_bad_request_is_answered(driver, request_):
    served, _, guard, program = driver
    guard.send(Release(7).encode())
    program.send(json.dumps(request_).encode())
    served.step(0.0)
    assert answers(program)[0]["ok"] is False


def test_a_number_beyond_all_floats_is_answered_and_does_not_end_the_driver(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=10**400)
    assert served.step(0.0)
    assert answers(program)[0]["ok"] is False
    assert "moveJ" not in stops(made._program.control)


def test_the_program_starts_again_only_after_command_0(driver):
    """The register of a latched speedJ is still there: a new program would execute it at once (see test_lifecycle)."""
    served, made, guard, _ = driver
    served.step(0.0)
    made._program.control.playing = False
    made._program.control.calls.clear()
    served._kicked = -1.0
    served.step(0.0)
    assert made._program.control.calls == []  # no kick without a program: each would be a line on the terminal
    guard.send(Release(7).encode())
    served.step(0.0)
    assert [call[0] for call in made._program.control.calls] == ["kick", "reuploadScript", "setWatchdog"]
    guard.send(Release(7).encode())
    served.step(0.0)
    assert "reuploadScript" not in [call[0] for call in made._program.control.calls[3:]]


def test_a_program_that_does_not_start_again_is_an_error(driver):
    served, made, guard, program = driver
    made._program.control.playing = made._program.control.accepts = False
    guard.send(Release(7).encode())
    served.step(0.0)
    assert "does not start ur_rtde's program again" in StatusReport.decode(guard.receive()[-1]).text
    move(program)
    served.step(0.0)
    assert answers(program)[0]["stopped"] is True


def test_a_silent_guard_counts_as_dead(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    for _ in range(40):
        now[0] += 0.05
        guard.send(Heartbeat().encode())
        served.step(0.0)
    assert "stopJ" not in stops(made._program.control)
    now[0] += HEARTBEAT_TIMEOUT - 0.01
    served.step(0.0)
    assert "stopJ" not in stops(made._program.control)
    now[0] += 0.02
    served.step(0.0)
    assert stops(made._program.control)[-1] == "stopJ"
    assert "silent" in answers(program)[0]["why"]
    assert "silent" in StatusReport.decode(guard.receive()[-1]).text
    guard.send(Heartbeat().encode())
    move(program, now[0])
    served.step(0.0)
    assert answers(program)[0]["stopped"] is True  # alive again is not enough: the guard has to clear it


def test_a_guard_that_falls_silent_while_it_moves_the_arm_does_not_move_it_on(driver, now):
    served, made, guard, _ = driver
    for message in (Release(7), StopProgram(10.0), SetJointVelocity((0.1,) * 6, 4.0)):
        guard.send(message.encode())
    served.step(0.0)
    before = len(stops(made._program.control))
    now[0] += SETPOINT_TIMEOUT - 0.01
    served.step(0.0)
    assert len(stops(made._program.control)) == before
    now[0] += 0.02
    served.step(0.0)
    assert stops(made._program.control)[before:] == ["speedStop"]
    assert f"silent for {SETPOINT_TIMEOUT:g} s" in StatusReport.decode(guard.receive()[-1]).text
    now[0] += 100.0  # the arm stands, and no heartbeat is due any more
    served.step(0.0)
    assert stops(made._program.control)[before:] == ["speedStop"]


def test_a_sign_of_life_is_no_new_speed(driver, now):
    served, made, guard, _ = driver
    for message in (Release(7), StopProgram(10.0), SetJointVelocity((0.1,) * 6, 4.0)):
        guard.send(message.encode())
    served.step(0.0)
    before = len(stops(made._program.control))
    for _ in range(4):
        now[0] += 0.03
        guard.send(Heartbeat().encode())
        served.step(0.0)
    assert stops(made._program.control)[before:] == ["speedStop"]


def test_speeds_that_waited_are_overtaken_by_what_came_later(driver):
    served, made, guard, _ = driver
    for message in (
        Release(7),
        StopProgram(10.0),
        *[SetJointVelocity((0.1 * k,) * 6, 4.0) for k in range(9)],
        Heartbeat(),
    ):
        guard.send(message.encode())
    served.step(0.0)
    assert [call[2] for call in made._program.control.calls if call[0] == "speedJ"] == [pytest.approx(0.8)]
    for message in (*[SetJointVelocity((0.1 * k,) * 6, 4.0) for k in range(9)], EndReaction(10.0)):
        guard.send(message.encode())
    served.step(0.0)
    assert [call[0] for call in made._program.control.calls if call[0].startswith("speed")] == ["speedJ", "speedStop"]


def test_it_ends_on_request_and_first_limits_its_own_end(driver):
    served, made, guard, program = driver
    order = []
    served._on_end = lambda: order.append([call[0] for call in made._program.control.calls])
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    served.end()
    served.run()
    assert order == [["moveJ", "kick"]]  # before the stop, which may block for minutes
    assert stops(made._program.control)[-1] == "stopJ"


def test_the_watchdog_is_kicked(driver):
    served, made, _, _ = driver
    served.step(0.0)
    assert ("kick",) in made._program.control.calls


def test_a_stop_of_the_program_that_fails_leaves_no_stream_going_on(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5)
    served.step(0.0)
    guard.receive()

    def fail(_):
        raise RuntimeError("the wheel has lost it")

    made._program.control.speedStop = fail
    ask(program, do="stop", acceleration=2.0, number=2)
    served.step(0.0)
    assert stops(made._program.control) == ["speedJ", "stopJ"]
    (note,) = (StatusReport.decode(message) for message in guard.receive())
    assert (note.kind, "a stop of the program has failed" in note.text) == ("error", True)
    move(program)
    served.step(0.0)
    assert [answer["ok"] for answer in answers(program)] == [True, False, False]
    assert stops(made._program.control) == ["speedJ", "stopJ"]


def test_a_stop_does_not_wait_behind_all_that_threads_have_asked_for(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    taken = made._program.control.speedJ

    def take(*values):
        guard.send(StopProgram(9.0).encode())  # while the first of them is carried out
        return taken(*values)

    made._program.control.speedJ = take
    for number in range(1, 4):
        ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5, number=number)
    served.step(0.0)
    assert stops(made._program.control) == ["speedJ", "speedStop"]
    assert [(answer["number"], answer["ok"]) for answer in answers(program)] == [(1, True), (2, False), (3, False)]


# ---- requests that are late, and commands that are not renewed


@pytest.mark.parametrize("sent", [1e9, float("inf")])
def test_a_request_from_later_holds_no_longer_than_one_from_now(driver, now, sent):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5, sent=sent)
    served.step(0.0)
    now[0] += 0.49
    guard.send(Heartbeat().encode())
    served.step(0.0)
    assert stops(made._program.control) == ["speedJ"]
    now[0] += 0.02
    guard.send(Heartbeat().encode())
    served.step(0.0)
    assert "speedStop" in stops(made._program.control)


def test_a_request_that_has_waited_for_long_is_void_and_says_its_number(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    served.step(0.0)
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=2.0, number=41, sent=now[0] - 0.21)
    ask(program, do="speed_j", qd=[1.0] * 6, acceleration=2.0, duration=0.5, number=42, sent=now[0] - 3.0)
    ask(program, do="stop", acceleration=2.0, number=43, sent=now[0] - 3.0)  # a stop is never too late
    served.step(0.0)
    told = answers(program)
    assert [(answer["number"], answer["ok"]) for answer in told] == [(41, False), (42, False), (43, True)]
    assert "it is void: it was sent 3.00 s ago" in told[1]["why"]
    assert stops(made._program.control) == ["stopJ"]


@pytest.mark.parametrize(
    ("request_", "start", "stop"),
    [
        ({"do": "speed_j", "qd": [0.5] * 6, "acceleration": 2.0, "duration": 0.5}, "speedJ", "speedStop"),
        ({"do": "servo_j", "q": [0.5] * 6, "duration": 0.5}, "servoJ", "servoStop"),
        ({"do": "speed_l", "twist": [0.5] * 6, "acceleration": 2.0, "duration": 0.5}, "speedL", "speedStop"),
        ({"do": "servo_l", "pose": [0.5] * 6, "duration": 0.5}, "servoL", "servoStop"),
    ],
)
def test_speeds_and_positions_are_not_kept_for_a_program_that_sends_no_more(driver, now, request_, start, stop):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    for _ in range(5):  # renewed in time
        ask(program, sent=now[0], **request_)
        served.step(0.0)
        now[0] += 0.4
        guard.send(Heartbeat().encode())
        served.step(0.0)
    assert stop not in stops(made._program.control)
    guard.receive()
    now[0] += 0.11
    guard.send(Heartbeat().encode())
    served.step(0.0)
    assert stops(made._program.control)[-1] == stop
    reports = [StatusReport.decode(message) for message in guard.receive()]
    assert any(report.kind == "remark" and "no new speed or servo command" in report.text for report in reports)
    count = len(stops(made._program.control))
    now[0] += 0.1
    served.step(0.0)
    assert len(stops(made._program.control)) == count  # once
    ask(program, sent=now[0], **request_)  # the program may go on
    served.step(0.0)
    assert stops(made._program.control)[-1] == start


@pytest.mark.parametrize(
    "refused",
    [
        {"do": "speed_j", "qd": [0.5] * 6, "acceleration": 2.0, "duration": 0.0},
        {"do": "servo_j", "q": [0.5] * 6, "duration": 20.0},
        {"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 0.0},
        {"do": "move_l", "pose": [0.0] * 6, "speed": 1.0, "acceleration": float("nan")},
        {"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 0.01},  # a stop with it would take minutes
        {"do": "stop", "acceleration": "x"},
        {"do": "dance"},
        {"do": "speed_j"},
    ],
)
def test_a_request_that_is_refused_does_not_renew_what_is_under_way(driver, now, refused):
    """The program caught what the refusal raised, and hung: its speeds moved the arm without end."""
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.3, sent=now[0])
    served.step(0.0)
    now[0] += 0.1
    ask(program, sent=now[0], **refused)
    served.step(0.0)
    assert [answer["ok"] for answer in answers(program)] == [True, False]
    now[0] += 0.21
    served.step(0.0)
    assert stops(made._program.control)[-1] == "speedStop"


def test_the_retreat_of_the_guard_does_not_end_with_the_speeds_of_the_program(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.05, sent=now[0])
    served.step(0.0)
    guard.send(SetJointVelocity((0.1,) * 6, 4.0).encode())
    served.step(0.0)
    now[0] += 0.09
    served.step(0.0)
    assert "speedStop" not in stops(made._program.control)


@pytest.mark.parametrize("duration", [0.0, -1.0, 10.1, float("nan"), None, "x"])
def test_a_duration_that_cannot_be_moves_nothing(driver, duration):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=duration)
    served.step(0.0)
    assert answers(program)[0]["ok"] is False
    assert "speedJ" not in stops(made._program.control)


def test_a_release_is_acknowledged_by_its_number_and_not_where_the_program_does_not_start(driver):
    served, made, guard, _ = driver
    guard.send(Release(41).encode())
    served.step(0.0)
    assert StatusReport("released", "41").encode() in guard.receive()
    made._program.control.playing = made._program.control.accepts = False
    guard.send(Release(42).encode())
    served.step(0.0)
    assert StatusReport("released", "42").encode() not in guard.receive()


def test_it_says_before_a_call_that_may_block_for_how_long(driver):
    served, _, guard, _ = driver
    announced = []
    served._work = announced.append
    guard.send(StopProgram(7.0).encode())
    served.step(0.0)
    assert announced == [0.0, pytest.approx(3.5 / 7.0 + 0.3), 0.0]


# ---- paths, progress, questions


def path(program, sent=10.0, **more):
    points = [Waypoint.move_j([0.1] * 6, blend=0.02), Waypoint.move_l([0.2] * 6, speed=0.3), Waypoint.move_p([0.3] * 6)]
    ask(program, do="move_path", waypoints=points, sent=sent, **more)


def test_a_path_is_announced_before_its_program_starts_anew_and_gets_a_watchdog_at_once(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    path(program)
    served.step(0.0)
    assert [call[0] for call in made._program.control.calls] == ["movePath", "setWatchdog", "kick"]
    (_, *entries), _ = made._program.control.calls[-3:-1]
    assert entries == [
        ("movej", "joints", [1.05, 1.4, 0.02]),
        ("movel", "pose", [0.3, 1.2, 0.0]),
        ("movep", "pose", [0.25, 1.2, 0.0]),
    ]
    assert [StatusReport.decode(m).kind for m in guard.receive()][-2:] == ["restarts", "restarted"]
    assert answers(program) == []  # it waits
    made._program.control.running = False
    served.step(0.0)
    assert answers(program) == [{"number": 1, "ok": True}]


def test_a_path_that_gets_no_watchdog_is_stopped_and_not_reported_as_restarted(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    made._program.control.setWatchdog = lambda frequency: False
    path(program)
    served.step(0.0)
    assert stops(made._program.control) == ["movePath", "stopJ"]
    (answer,) = answers(program)
    assert "did not take the watchdog of a path: it was stopped" in answer["why"]
    assert "restarted" not in [StatusReport.decode(m).kind for m in guard.receive()]


def test_a_stop_that_came_while_a_path_was_taken_is_the_next_thing_that_is_done(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    taken = made._program.control.movePath

    def take(entries, asynchronous):
        guard.send(StopProgram(9.0).encode())
        return taken(entries, asynchronous)

    made._program.control.movePath = take
    path(program)
    served.step(0.0)
    assert answers(program) == []
    served.step(0.0)
    assert stops(made._program.control) == ["movePath", "stopJ"]
    assert [answer["stopped"] for answer in answers(program)] == [True]


@pytest.mark.parametrize(
    "waypoints",
    [[], [["j", True, [0.0] * 5, 1.0, 1.0, 0.0]], [["c", True, [0.0] * 6, 1.0, 1.0, 0.0]], [["j"]], 3, [[0.0] * 9]],
)
def test_a_path_that_cannot_be_moves_nothing(driver, waypoints):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="move_path", waypoints=waypoints)
    served.step(0.0)
    assert answers(program)[0]["ok"] is False
    assert "movePath" not in stops(made._program.control)


def test_progress_is_told_and_several_may_wait_for_the_end(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    path(program, wait=False)
    ask(program, do="progress", number=2)
    ask(program, do="wait", number=3)
    ask(program, do="wait", number=4)
    served.step(0.0)
    assert answers(program) == [
        {"number": 1, "ok": True},
        {"number": 2, "ok": True, "waypoint": 2, "mode": "move"},
    ]
    made._program.control.running = False
    served.step(0.0)
    ask(program, do="progress", number=5)
    ask(program, do="wait", number=6)
    served.step(0.0)
    assert [(a["number"], a.get("waypoint", "-")) for a in answers(program)] == [
        (3, "-"),
        (4, "-"),
        (5, None),
        (6, "-"),
    ]


@pytest.mark.parametrize(
    ("then", "why"),
    [
        ({"do": "stop", "acceleration": 2.0}, "the program itself has stopped the arm"),
        ({"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 2.0}, "another motion of the program"),
    ],
)
def test_who_waits_for_a_move_that_the_program_has_ended_is_told_that_it_did_not_arrive(driver, then, why):
    served, _, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.step(0.0)
    ask(program, number=2, **then)
    served.step(0.0)
    first = answers(program)[0]
    assert (first["number"], first["ok"], first["stopped"]) == (1, False, False)
    assert why in first["why"]


def test_a_question_is_answered_while_nothing_moves_with_the_tool_that_is_set(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="ask", what="getForwardKinematics", values=[[0.1] * 6])
    ask(program, do="ask", what="stopScript", values=[], number=2)
    ask(program, do="speed_l", twist=[0.1] * 6, acceleration=1.0, duration=0.5, number=3)
    ask(program, do="ask", what="getForwardKinematics", values=[], number=4)
    served.step(0.0)
    told = answers(program)
    assert told[0] == {"number": 1, "ok": True, "value": [0.5] * 6}
    assert [a["ok"] for a in told] == [True, False, True, False]
    assert "stopScript is not a question" in told[1]["why"]
    assert "must wait until the arm has arrived or was stopped" in told[3]["why"]
    (call,) = [call for call in made._program.control.calls if call[0] == "getForwardKinematics"]
    assert call[1] == [0.1] * 6
    assert call[2] == pytest.approx([0.0] * 6, abs=1e-11)
    assert any(call[2]), "exact zeros make the wheel send a packet of a wrong size"


def test_a_stop_that_the_program_asks_for_is_not_ended_by_the_watchdog_and_one_of_the_guard_comes_first(driver):
    """At 3 rad/s it takes 0.3 s and more, in which nothing kicks: the program ended, and that was a fault."""
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    for number, end in enumerate(
        ({"do": "stop", "acceleration": 2.0}, {"do": "servo_j", "q": [0.0] * 6, "duration": 1.0})
    ):
        ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=1.0)
        made._program.control.calls.clear()
        ask(program, number=2, **end)
        served.step(0.0)
        calls = [call for call in made._program.control.calls if call[0] in ("setWatchdog", "speedStop")]
        assert [call[0] for call in calls] == ["setWatchdog", "speedStop", "setWatchdog"], number
        assert (1.0 / calls[0][1], calls[2][1]) == (pytest.approx(3.5 / 2.0 + 0.3), 4.0)  # as long as it may take
    made._program.control.calls.clear()
    guard.send(StopProgram(9.0).encode())
    served.step(0.0)
    assert [call[0] for call in made._program.control.calls if call[0] != "kick"] == ["servoStop"]
