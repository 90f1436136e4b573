"""The owner of ur_rtde on a mocked arm: the guard comes first, and the arm is stopped when anybody leaves."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.errors import RobotConnectionError, RobotRefused
from coneskin.robot.channel import Channel, pair
from coneskin.robot.owner import Owner
from coneskin.robot.owner_messages import (
    SILENCE,
    STEERING_SILENCE,
    Alive,
    Clear,
    Farewell,
    Halt,
    Note,
    Speed,
    Stop,
    decode_command,
    decode_json,
    encode_json,
)
from coneskin.robot.ur_rtde import Mode, UrArm, rtde_errors

finite = st.floats(allow_nan=False)


@given(
    st.one_of(
        st.builds(Stop, finite),
        st.builds(Halt, finite),
        st.sampled_from([Clear(), Alive(), Farewell()]),
        st.builds(Speed, st.tuples(*[finite] * 6), finite),
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
    assert command.encode() == message or message[:1] in b"VSH"


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

        return Status()


def arm(accepts=True):
    made = UrArm("test", 4.0)
    made._control = FakeWheel(accepts)
    return made


def stops(wheel):
    return [call[0] for call in wheel.calls if call[0] not in ("kick",)]


@pytest.mark.parametrize(
    ("start", "stop"),
    [
        (lambda a: a.move_j([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_l([0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.speed_j([0.0] * 6, 1.0), "speedStop"),
        (lambda a: a.servo_j([0.0] * 6), "servoStop"),
    ],
)
def test_each_mode_has_its_own_stop(start, stop):
    a = arm()
    start(a)
    a.stop(5.0)
    assert stops(a._control)[-1] == stop
    assert a.mode is Mode.IDLE


def test_no_motion_starts_on_a_live_thread_of_another_kind():
    a = arm()
    a.move_j([0.0] * 6, 1.0, 1.0)
    a.speed_j([0.0] * 6, 1.0)
    a.servo_j([0.0] * 6)
    a.move_l([0.0] * 6, 1.0, 1.0)
    assert stops(a._control) == ["moveJ", "stopJ", "speedJ", "speedStop", "servoJ", "servoStop", "moveL"]


def test_what_the_wheel_refuses_is_an_error():
    a = arm(accepts=False)
    with pytest.raises(RobotRefused, match="did not take moveJ: its program is not running"):
        a.move_j([0.0] * 6, 1.0, 1.0)
    assert a.mode is Mode.IDLE
    with pytest.raises(RobotConnectionError, match="stopping: broken"), rtde_errors("stopping"):
        raise RuntimeError("broken")


@pytest.fixture
def now():
    """The owner's clock, to be set."""
    return [10.0]


@pytest.fixture
def owner(now):
    made = arm()
    (guard, guard_end), (program, program_end) = ((Channel(s) for s in pair()) for _ in range(2))
    served = Owner(made, guard_end, program_end, lambda: now[0])
    yield served, made, guard, program
    for channel in (guard, guard_end, program, program_end):
        channel.close()


def ask(program, **request):
    program.send(encode_json(request))


def answers(channel):
    return [decode_json(message) for message in channel.receive()]


def move(program):
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=2.0)


def test_the_program_is_refused_until_the_guard_clears_it(owner):
    served, made, guard, program = owner
    move(program)
    assert served.step(0.0)
    assert answers(program)[0]["stopped"] is True
    assert "moveJ" not in stops(made._control)
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    assert stops(made._control) == ["moveJ"]


def test_a_stop_comes_before_what_the_program_asked_and_ends_its_wait(owner):
    served, made, guard, program = owner
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    assert answers(program) == []  # it waits for the end of the move
    move(program)
    guard.send(Stop(9.0).encode())
    served.step(0.0)
    assert stops(made._control) == ["moveJ", "stopJ"]
    assert [answer["stopped"] for answer in answers(program)] == [True, True]
    assert Note("done").encode() in guard.receive()


def test_the_end_of_a_move_is_told(owner):
    served, made, guard, program = owner
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    made._control.running = False
    served.step(0.0)
    assert answers(program) == [{"ok": True}]


def test_a_retreat_and_its_halt(owner):
    served, made, guard, _ = owner
    guard.send(Speed((0.1, 0, 0, 0, 0, 0), 2.0).encode())
    served.step(0.0)
    guard.send(Halt(8.0).encode())
    served.step(0.0)
    assert stops(made._control) == ["speedJ", "speedStop"]


@pytest.mark.parametrize("who", ["guard", "program"])
def test_when_either_side_leaves_the_arm_is_stopped(owner, who):
    served, made, guard, program = owner
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    (guard if who == "guard" else program).close()
    served.run()
    assert stops(made._control)[-1] == "stopJ"


def test_an_error_of_the_wheel_goes_to_the_guard(owner):
    served, made, guard, _ = owner
    made._control.accepts = False
    guard.send(Speed((0.1, 0, 0, 0, 0, 0), 2.0).encode())
    served.step(0.0)
    notes = [Note.decode(message) for message in guard.receive()]
    assert notes[0].kind == "error"
    assert "speedJ" in notes[0].text


@pytest.mark.parametrize(
    "request_", [{"do": "dance"}, {"do": "move_j"}, {"do": "move_j", "q": 1}, {}, {"do": "speed_j", "qd": []}]
)
def test_a_bad_request_is_answered(owner, request_):
    served, _, guard, program = owner
    guard.send(Clear().encode())
    program.send(json.dumps(request_).encode())
    served.step(0.0)
    assert answers(program)[0]["ok"] is False


def test_the_program_starts_again_only_after_command_0(owner):
    """The register of a latched speedJ is still there: a new program would execute it at once (see test_lifecycle)."""
    served, made, guard, _ = owner
    served.step(0.0)
    made._control.playing = False
    made._control.calls.clear()
    served._kicked = -1.0
    served.step(0.0)
    assert made._control.calls == []  # no kick without a program: each would be a line on the terminal
    guard.send(Clear().encode())
    served.step(0.0)
    assert [call[0] for call in made._control.calls] == ["kick", "reuploadScript", "setWatchdog"]
    guard.send(Clear().encode())
    served.step(0.0)
    assert "reuploadScript" not in [call[0] for call in made._control.calls[3:]]


def test_a_program_that_does_not_start_again_is_an_error(owner):
    served, made, guard, program = owner
    made._control.playing = made._control.accepts = False
    guard.send(Clear().encode())
    served.step(0.0)
    assert "does not start ur_rtde's program again" in Note.decode(guard.receive()[-1]).text
    move(program)
    served.step(0.0)
    assert answers(program)[0]["stopped"] is True


def test_a_silent_guard_counts_as_dead(owner, now):
    served, made, guard, program = owner
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    for _ in range(40):
        now[0] += 0.05
        guard.send(Alive().encode())
        served.step(0.0)
    assert "stopJ" not in stops(made._control)
    now[0] += SILENCE - 0.01
    served.step(0.0)
    assert "stopJ" not in stops(made._control)
    now[0] += 0.02
    served.step(0.0)
    assert stops(made._control)[-1] == "stopJ"
    assert "silent" in answers(program)[0]["why"]
    assert "silent" in Note.decode(guard.receive()[-1]).text
    guard.send(Alive().encode())
    move(program)
    served.step(0.0)
    assert answers(program)[0]["stopped"] is True  # alive again is not enough: the guard has to clear it


def test_a_guard_that_falls_silent_while_it_moves_the_arm_does_not_move_it_on(owner, now):
    served, made, guard, _ = owner
    for message in (Clear(), Stop(10.0), Speed((0.1,) * 6, 4.0)):
        guard.send(message.encode())
    served.step(0.0)
    before = len(stops(made._control))
    now[0] += STEERING_SILENCE - 0.01
    served.step(0.0)
    assert len(stops(made._control)) == before
    now[0] += 0.02
    served.step(0.0)
    assert stops(made._control)[before:] == ["speedStop"]
    assert f"silent for {STEERING_SILENCE:g} s" in Note.decode(guard.receive()[-1]).text
    now[0] += 100.0  # it stands, and nobody has to say anything any more
    served.step(0.0)
    assert stops(made._control)[before:] == ["speedStop"]


def test_a_sign_of_life_is_no_new_speed(owner, now):
    served, made, guard, _ = owner
    for message in (Clear(), Stop(10.0), Speed((0.1,) * 6, 4.0)):
        guard.send(message.encode())
    served.step(0.0)
    before = len(stops(made._control))
    for _ in range(4):
        now[0] += 0.03
        guard.send(Alive().encode())
        served.step(0.0)
    assert stops(made._control)[before:] == ["speedStop"]


def test_speeds_that_waited_are_overtaken_by_what_came_later(owner):
    served, made, guard, _ = owner
    for message in (Clear(), Stop(10.0), *[Speed((0.1 * k,) * 6, 4.0) for k in range(9)], Alive()):
        guard.send(message.encode())
    served.step(0.0)
    assert [call[2] for call in made._control.calls if call[0] == "speedJ"] == [pytest.approx(0.8)]
    for message in (*[Speed((0.1 * k,) * 6, 4.0) for k in range(9)], Halt(10.0)):
        guard.send(message.encode())
    served.step(0.0)
    assert [call[0] for call in made._control.calls if call[0].startswith("speed")] == ["speedJ", "speedStop"]


def test_it_leaves_when_told_and_arms_its_own_end_first(owner):
    served, made, guard, program = owner
    order = []
    served._leaving = lambda: order.append([call[0] for call in made._control.calls])
    guard.send(Clear().encode())
    move(program)
    served.step(0.0)
    served.leave()
    served.run()
    assert order == [["moveJ", "kick"]]  # before the stop, which may block for minutes
    assert stops(made._control)[-1] == "stopJ"


def test_the_watchdog_is_kicked(owner):
    served, made, _, _ = owner
    served.step(0.0)
    assert ("kick",) in made._control.calls
