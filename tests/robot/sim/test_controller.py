"""The simulated controller without sockets: programs, safety, watchdog, registers, the dashboard's lines."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import pytest

from coneskin.errors import KinematicsError, RobotRefused
from coneskin.robot.sim.controller import Controller
from coneskin.robot.sim.functions.builtins import Builtins
from coneskin.robot.sim.notices import ErrorNotice
from coneskin.robot.sim.options import Options
from coneskin.robot.sim.polyscope.dashboard import Dashboard
from coneskin.robot.sim.polyscope.user_interface import UserInterface
from coneskin.robot.sim.urscript.translator import translate
from coneskin.robot.sim.urscript.values import rotvec_between, values_of

FAR = "[1.5, -1.5708, 1.5708, -1.5708, -1.5708, 0]"


class Bench:
    """A controller, its log, and what a test does with it."""

    def __init__(self, **options: Any) -> None:
        self.text = io.StringIO()
        self.controller = Controller(Options(**options), self.text)
        self.dashboard = Dashboard(UserInterface(self.controller, self.send)).answer

    def send(self, text: str) -> None:
        made = translate(text, Builtins.names(), Builtins.blocking())
        if not made.secondary:
            self.controller.program_arrived()
        self.controller.load(made)

    def step(self, cycles: int) -> None:
        for _ in range(cycles):
            self.controller.step()

    def events(self, kind: str) -> list[dict[str, Any]]:
        lines = [json.loads(line) for line in self.text.getvalue().splitlines()]
        return [line for line in lines if line["event"] == kind]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_program_starts_after_its_delay_and_ends_with_its_text(bench: Bench) -> None:
    bench.send("def p():\n  sleep(0.01)\nend\n")
    bench.step(4)
    assert bench.controller.runtime.name == "STOPPED"
    bench.step(1)  # 10 ms
    assert bench.controller.runtime.name == "PLAYING"
    bench.step(6)
    assert bench.controller.runtime.name == "STOPPED"


def test_a_raw_line_stops_whatever_moves_the_arm(bench: Bench) -> None:
    bench.send(f"def user():\n  movej({FAR}, a=5, v=1)\nend\n")
    bench.step(150)
    assert bench.controller.arm.qd[0] == pytest.approx(1.0)
    bench.send("stopj(4)\n")
    bench.step(5)  # until the new one starts, the old one's end brakes the arm
    slower = bench.controller.arm.qd[0]
    assert slower < 1.0
    bench.step(125)
    assert not bench.controller.arm.moving
    assert bench.controller.runtime.name == "STOPPED"
    assert bench.controller.arm.q[0] < 1.0


def test_a_time_that_is_too_short_makes_a_move_as_fast_as_it_can_be(bench: Bench) -> None:
    """As Universal Robots' client library has it in its tests: no protective stop."""
    bench.send(f"def p():\n  movej({FAR}, a=1.4, v=1.4, t=0.1)\n  write_output_integer_register(0, 1)\nend\n")
    bench.step(1500)
    assert bench.controller.safety.name == "NORMAL"
    assert bench.controller.output_ints[0] == 1
    assert bench.controller.arm.q[0] == pytest.approx(1.5)


def test_a_raw_program_stops_and_retreats(bench: Bench) -> None:
    bench.send(f"movej({FAR}, a=5, v=1)\n")
    bench.step(150)
    bench.send("def retreat():\n  stopj(10)\n  speedj([-0.5,0,0,0,0,0], a=5, t=0.2)\n  stopj(10)\nend\n")
    bench.step(40)
    turned = bench.controller.arm.q[0]
    bench.step(200)
    assert not bench.controller.arm.moving
    # 0.5 rad/s for 0.2 s, with a ramp up of 0.1 s: 0.075 rad, and 0.0125 rad of the stop
    assert turned - bench.controller.arm.q[0] == pytest.approx(0.0875, abs=0.03)


def test_two_threads_that_move_the_arm_end_the_program(bench: Bench) -> None:
    bench.send(
        f"def p():\n  thread t():\n    movej({FAR})\n  end\n  run t()\n  sleep(0.1)\n"
        "  speedl([0, 0, 0.1, 0, 0, 0], 1, 1)\nend\n"
    )
    bench.step(500)
    assert bench.events("abort")[0]["reason"] == "Another thread is already controlling the robot"
    assert not bench.controller.arm.moving


def test_killing_the_thread_that_moves_makes_the_arm_brake(bench: Bench) -> None:
    bench.send(
        f"def p():\n  thread t():\n    movej({FAR}, a=5, v=1)\n  end\n  m = run t()\n  sleep(0.3)\n  kill m\n"
        "  while True:\n    sync()\n  end\nend\n"
    )
    bench.step(400)
    assert not bench.controller.arm.moving
    assert bench.controller.arm.q[0] < 1.0
    assert bench.controller.runtime.name == "PLAYING"


def test_a_secondary_program_runs_beside_and_cannot_move_the_arm(bench: Bench) -> None:
    bench.send(f"def p():\n  movej({FAR}, a=5, v=1)\nend\n")
    bench.step(100)
    bench.send("sec s():\n  set_standard_digital_out(2, True)\nend\n")
    bench.send("sec bad():\n  stopj(2)\nend\n")
    bench.step(3)
    assert bench.controller.digital_outputs == 4
    assert bench.controller.arm.qd[0] > 0.5
    assert bench.events("abort")[0]["reason"] == "a secondary program must not move the arm"


def test_speedj_takes_a_new_speed_only_when_its_time_is_over(bench: Bench) -> None:
    """With a time, after it; without, when the first speed is reached (URScript manual, speedj)."""
    first = "[0.5, 0, 0, 0, 0, 0]"
    loop = "def p():\n  speedj({0}, a=1, t={1})\n  write_output_integer_register(0, 1)\n  stopj(1)\nend\n"
    for text, cycles in ((loop.format(first, 0.1), 50), (loop.format(first, 0), 250)):
        case = Bench(start_delay=0.002)
        case.send(text)
        case.step(1)
        while not case.controller.output_ints[0]:
            case.step(1)
        assert case.controller.cycle - 1 == pytest.approx(cycles, abs=1)


def test_a_joint_limit_is_a_protective_stop_that_ends_the_program(bench: Bench) -> None:
    bench.send("speedj([0, 0, 1.5, 0, 0, 0], a=5, t=100)\n")
    bench.step(2000)
    assert bench.controller.safety.name == "PROTECTIVE_STOP"
    assert "joint 3" in bench.events("protective_stop")[0]["reason"]
    assert not bench.controller.arm.moving
    assert bench.controller.arm.q[2] < bench.controller.arm.model.joint_upper[2]


def test_a_protective_stop_pauses_and_refuses_programs_until_it_is_unlocked(bench: Bench) -> None:
    bench.send(f"movej({FAR}, a=5, v=1)\n")
    bench.step(150)
    bench.send("def s():\n  protective_stop()\nend\n")
    bench.step(200)
    assert bench.controller.safety.name == "PROTECTIVE_STOP"
    assert not bench.controller.arm.moving
    bench.send("stopj(2)\n")
    assert bench.dashboard("unlock protective stop").startswith("Cannot unlock protective stop until 5s")
    bench.step(2500)  # 5 s
    assert bench.dashboard("play") == "Failed to execute: play"
    assert bench.dashboard("unlock protective stop") == "Protective stop releasing"
    assert bench.dashboard("safetystatus") == "Safetystatus: NORMAL"
    assert bench.dashboard("play") == "Starting program"


def test_a_protective_stop_can_end_the_program_instead() -> None:
    bench = Bench(after_protective_stop="stop")
    bench.send(f"movej({FAR})\n")
    bench.step(50)
    bench.controller.protective_stop("test")
    assert bench.controller.runtime.name == "STOPPING"
    bench.step(100)
    assert bench.controller.runtime.name == "STOPPED"
    assert not bench.controller.arm.moving


def test_pause_and_play_go_on_to_the_same_end(bench: Bench) -> None:
    bench.send(f"def p():\n  movej({FAR}, a=5, v=1)\n  write_output_integer_register(0, 1)\nend\n")
    bench.step(150)
    assert bench.dashboard("pause") == "Pausing program"
    bench.step(100)
    assert not bench.controller.arm.moving
    assert bench.dashboard("programState") == "PAUSED p"
    assert bench.dashboard("running") == "Program running: false"
    assert bench.dashboard("play") == "Starting program"
    bench.step(1000)
    assert bench.controller.arm.q[0] == pytest.approx(1.5)
    assert bench.controller.output_ints[0] == 1


def test_the_watchdog_counts_packets_that_hold_its_variable(bench: Bench) -> None:
    bench.send('def p():\n  rtde_set_watchdog("input_int_register_0", 10, "stop")\n  sleep(100)\nend\n')
    bench.step(10)
    for _ in range(10):
        bench.step(45)  # 90 ms
        bench.controller.write_inputs({"input_int_register_0": 0})
    assert bench.controller.runtime.name == "PLAYING"
    bench.step(45)
    bench.controller.write_inputs({"input_double_register_0": 1.0})
    bench.step(10)
    assert bench.controller.runtime.name == "STOPPED"


def test_an_emergency_stop_ends_everything_until_power_is_back(bench: Bench) -> None:
    bench.send(f"movej({FAR}, a=5, v=1)\n")
    bench.step(150)
    bench.controller.emergency_stop()
    bench.step(100)
    assert not bench.controller.arm.moving
    assert bench.dashboard("robotmode") == "Robotmode: POWER_OFF"
    assert bench.dashboard("brake release") == "Brake releasing"
    assert bench.dashboard("robotmode") == "Robotmode: POWER_OFF"  # still in emergency stop
    for line in ("restart safety", "power on", "brake release"):
        bench.dashboard(line)
    assert bench.dashboard("robotmode") == "Robotmode: RUNNING"


def test_a_program_that_is_refused_leaves_the_arm_alone(bench: Bench) -> None:
    bench.dashboard("power off")
    bench.send(f"movej({FAR})\n")
    bench.step(100)
    assert bench.events("refused")[0]["reason"] == "POWER_OFF, NORMAL"
    assert bench.controller.arm.q[0] == 0.0


def test_unknown_lines_are_answered(bench: Bench) -> None:
    assert bench.dashboard("dance") == "could not understand: 'dance'"


def test_the_log_says_when_a_command_was_taken(bench: Bench) -> None:
    bench.send("def p():\n  while True:\n    x = read_input_integer_register(0)\n    sync()\n  end\nend\n")
    bench.step(20)
    bench.controller.write_inputs({"input_int_register_0": 34, "input_double_register_0": 2.0})
    bench.step(3)
    (received,), (taken,) = bench.events("received"), bench.events("taken")
    assert (received["command"], received["values"]) == (34, [2.0])
    assert taken["cycle"] == received["cycle"] + 1
    assert taken["monotonic"] >= received["monotonic"]


def test_a_start_beyond_the_limits_and_an_unknown_arm_are_refused() -> None:
    with pytest.raises(RobotRefused, match="start position of joint 3"):
        Controller(Options(start_q=(0, 0, 4.0, 0, 0, 0)))
    with pytest.raises(KinematicsError, match="UR10e"):
        Controller(Options(model="ur99"))


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("speedj([0, 0, 0, 0, 0], 1)", "joint speeds must be 6 numbers"),
        ("write_output_integer_register(0, 2^40)", "an integer register holds 32 bits"),
        ("set_payload(1, [0, 0])", "a centre of gravity must be 3 numbers"),
        ("x = 1 / 0", "ZeroDivisionError"),
        ("movej([1, 2])", "joint positions must be 6 numbers"),
        ("x = [1, 2]\n  y = x[5]", "IndexError"),
    ],
)
def test_a_mistake_ends_the_program_and_not_the_controller(bench: Bench, line: str, reason: str) -> None:
    bench.send(f"def p():\n  {line}\nend\n")
    bench.step(20)
    assert reason in bench.events("abort")[0]["reason"]
    assert bench.controller.runtime.name == "STOPPED"


JUMPS = {
    "servoj": ("servoj([1.5, -1.5708, 1.5708, -1.5708, -1.5708, 0], t=0.1)", "C204A1"),
    "speedj": ("speedj([0, -1, 0, 0, 0, 0], a=60)", "C153A1"),
    "speedj at once": ("speedj([1, 0, 0, 0, 0, 0], a=1000)", "C204A1"),
    "movej": (f"movej({FAR}, a=150, v=2)", "C204A1"),
    "speedj too fast": ("speedj([0, 0, 0, 0, 0, 4], a=5, t=9)", "C204A5"),
    "speedl": ("speedl([0, 0, 1.0, 0, 0, 0], a=200)", "C204A7"),
    "protective_stop": ("protective_stop()", "C209A0"),
}


@pytest.mark.parametrize("name", JUMPS)
def test_a_motion_that_no_arm_can_follow_is_a_protective_stop_under_its_published_number(name: str) -> None:
    """The program is ended, the log says which, and so does a message to each client of the primary interface."""
    text, number = JUMPS[name]
    bench = Bench()
    bench.send(f"def p():\n  {text}\nend\n")
    bench.step(1000)
    assert [event["cause"] for event in bench.events("protective_stop")] == [number]
    assert bench.controller.safety.name == "PROTECTIVE_STOP"
    assert not bench.controller.arm.moving
    told = [notice for notice in bench.controller.notices if isinstance(notice, ErrorNotice)]
    assert [f"C{notice.code}A{notice.argument}" for notice in told] == [number]


def test_a_line_that_the_arm_cannot_follow_is_a_protective_stop(bench: Bench) -> None:
    """So do controllers, by Universal Robots' own test of movel(p[10, 0, 0, 0, 0, 0])."""
    bench.send("def p():\n  movel(p[9, 0, 0, 0, 0, 0])\n  movej([1, 0, 0, 0, 0, 0])\nend\n")
    bench.step(20)
    assert "cannot bring its flange" in bench.events("protective_stop")[0]["reason"]
    assert bench.controller.safety.name == "PROTECTIVE_STOP"
    bench.step(2600)
    assert bench.controller.unlock()
    assert bench.controller.resume_program()
    bench.step(20)
    assert bench.controller.runtime.name == "STOPPED"  # it does not go on as if it had arrived
    assert not bench.controller.arm.moving


def test_a_speed_that_is_not_a_number_does_not_reach_the_arm(bench: Bench) -> None:
    bench.send("def p():\n  speedj([read_input_float_register(0), 0, 0, 0, 0, 0], 1)\nend\n")
    bench.controller.write_inputs({"input_double_register_0": float("nan")})
    bench.step(20)
    assert "joint speeds must be finite" in bench.events("abort")[0]["reason"]
    assert not bench.controller.arm.moving


@pytest.mark.parametrize(("action", "state"), [("STOP", "STOPPED"), ("PAUSE", "PAUSED"), ("IGNORE", "PLAYING")])
def test_a_watchdog_does_what_it_was_given_in_any_case(bench: Bench, action: str, state: str) -> None:
    body = f'rtde_set_watchdog("input_int_register_0", 10, "{action}")\n  movej({FAR}, a=1, v=0.2)'
    bench.send(f"def p():\n  {body}\nend\n")
    bench.step(50)
    bench.step(10)
    runtime = bench.controller.runtime.name
    assert runtime == {"STOPPED": "STOPPING", "PAUSED": "PAUSING"}.get(state, state)  # while the arm brakes
    bench.step(100)
    assert bench.controller.runtime.name == state
    assert bench.controller.arm.moving == (state == "PLAYING")


def test_several_watchdogs_expire_each_by_its_own_variable(bench: Bench) -> None:
    lines = [f'rtde_set_watchdog("input_int_register_{i}", {hz}, "pause")' for i, hz in ((1, 10), (2, 2))]
    bench.send("def p():\n  " + "\n  ".join(lines) + "\n  sleep(100)\nend\n")
    bench.step(10)
    for _ in range(5):
        bench.step(40)
        bench.controller.write_inputs({"input_int_register_1": 0})
    assert bench.controller.runtime.name == "PLAYING"
    bench.step(45)  # 490 ms without the second
    bench.controller.write_inputs({"input_int_register_1": 0})
    bench.step(20)
    assert [event["variable"] for event in bench.events("watchdog")] == ["input_int_register_2"]
    assert bench.controller.runtime.name == "PAUSED"
    assert bench.dashboard("play") == "Starting program"
    bench.step(60)
    assert [event["variable"] for event in bench.events("watchdog")][1:] == ["input_int_register_1"]


@pytest.mark.parametrize(
    "arguments", ['"output_int_register_0", 10', '"nothing", 10', '"input_int_register_0", 10, "jump"']
)
def test_a_watchdog_of_no_input_or_with_no_action_ends_the_program(bench: Bench, arguments: str) -> None:
    bench.send(f"def p():\n  rtde_set_watchdog({arguments})\n  sleep(100)\nend\n")
    bench.step(10)
    assert "rtde_set_watchdog" in bench.events("abort")[0]["reason"]


def test_an_open_safeguard_holds_the_program_and_closing_it_starts_nothing(bench: Bench) -> None:
    bench.send(f"movej({FAR}, a=5, v=1)\n")
    bench.step(150)
    assert bench.controller.safeguard(True) == "SAFEGUARD_STOP"
    bench.step(100)
    assert not bench.controller.arm.moving
    assert bench.controller.resume_program() is False
    assert bench.controller.safeguard(False) == "NORMAL"
    bench.step(100)
    assert not bench.controller.arm.moving
    assert bench.dashboard("play") == "Starting program"
    bench.step(1000)
    assert bench.controller.arm.q[0] == pytest.approx(1.5)


def test_reduced_mode_slows_what_moves_and_outlives_a_protective_stop(bench: Bench) -> None:
    bench.send(f"movej({FAR}, a=5, v=1)\n")
    bench.step(150)
    assert bench.controller.reduce(True) == "REDUCED"
    bench.step(100)
    assert bench.controller.arm.qd[0] == pytest.approx(0.5)
    bench.controller.protective_stop("test")
    bench.step(100)
    assert bench.controller.unlock(early=True)
    assert bench.controller.safety.name == "REDUCED"
    assert bench.controller.resume_program()
    bench.step(100)
    assert bench.controller.arm.qd[0] == pytest.approx(0.5)
    assert bench.controller.reduce(False) == "NORMAL"


def _corner(radius: float) -> tuple[float, float, int]:
    """Go round a corner; return how near the tool came to it [m], its least speed on the way [m/s], and the cycles."""
    case = Bench()
    arm = case.controller.arm
    x, y, z = arm.tcp_pose().translation
    rest = ", ".join(map(str, list(values_of(arm.tcp_pose()))[3:]))
    corner, end = (x, y, z - 0.2), (x, y + 0.2, z - 0.2)
    body = ""
    for place, r in ((corner, radius), (end, 0)):
        body += f"  movel(p[{', '.join(map(str, place))}, {rest}], a=1, v=0.2, r={r})\n"
    case.send(f"def p():\n{body}end\n")
    nearest, slowest = 1.0, 1.0
    case.step(50)
    while case.controller.program is not None:
        case.step(1)
        here = arm.tcp_pose().translation
        nearest = min(nearest, math.dist(here, corner))
        if math.dist(here, (x, y, z)) > 0.01 and math.dist(here, end) > 0.03:
            slowest = min(slowest, math.hypot(*arm.twist()[:3]))
    assert math.dist(arm.tcp_pose().translation, end) < 1e-9
    return nearest, slowest, case.controller.cycle


def test_a_blend_goes_round_the_way_point_within_its_radius_and_without_a_stop() -> None:
    nearest, slowest, cycles = _corner(0.0)
    assert nearest < 1e-9
    assert slowest < 0.01
    blended = _corner(0.05)
    assert 0.001 < blended[0] < 0.05
    assert blended[1] > 0.05
    assert blended[2] < cycles - 20


def test_a_move_with_a_blend_that_nothing_follows_ends_at_its_goal(bench: Bench) -> None:
    bench.send(f"def p():\n  movej({FAR}, a=5, v=1, r=0.2)\n  write_output_integer_register(0, 1)\n  sleep(1)\nend\n")
    while not bench.controller.output_ints[0]:
        bench.step(1)
    assert bench.controller.arm.q[0] < 1.49
    bench.step(300)
    assert bench.controller.arm.q[0] == pytest.approx(1.5)
    bench = Bench()
    bench.send(f"movej({FAR}, a=5, v=1, r=0.2)\n")  # the program's last statement
    bench.step(1500)
    assert bench.controller.program is None
    assert bench.controller.arm.q[0] == pytest.approx(1.5)


@pytest.mark.parametrize("mode", [0, 1])
def test_an_arc_runs_over_its_way_point_on_a_circle(bench: Bench, mode: int) -> None:
    arm = bench.controller.arm
    start = arm.tcp_pose()
    (x, y, z), radius = start.translation, 0.1
    turn = list(values_of(start))[3:]
    angles = (math.pi / 9, math.pi / 4)
    places = [(x, y + radius * math.sin(angle), z - radius * (1 - math.cos(angle))) for angle in angles]
    via, end = ([*place, *turn] for place in places)
    bench.send(f"movec(p{via}, p{end}, a=1, v=0.1, mode={mode})\n")
    bench.step(10)
    centre, nearest = (x, y, z - radius), 1.0
    while bench.controller.program is not None:
        bench.step(1)
        here = arm.tcp_pose().translation
        assert math.dist(here, centre) == pytest.approx(radius, abs=1e-9)  # rounding of inverse kinematics
        nearest = min(nearest, math.dist(here, places[0]))
    assert nearest < 0.1 * 0.002  # the way of a cycle
    assert math.dist(arm.tcp_pose().translation, places[1]) < 1e-9
    turned = rotvec_between(start, arm.tcp_pose())
    assert math.hypot(*turned) == pytest.approx(angles[1] * mode, abs=1e-6)


def test_an_arc_over_a_point_on_its_chord_is_a_line(bench: Bench) -> None:
    x, y, z = bench.controller.arm.tcp_pose().translation
    turn = list(values_of(bench.controller.arm.tcp_pose()))[3:]
    bench.send(f"movec(p{[x, y, z - 0.05, *turn]}, p{[x, y, z - 0.1, *turn]})\n")
    bench.step(1000)
    assert math.dist(bench.controller.arm.tcp_pose().translation, (x, y, z - 0.1)) < 1e-9


def test_optimove_goes_at_shares_of_what_the_joints_can_do() -> None:
    joints = Bench()
    joints.send(f"optimovej({FAR}, a=1, v=0.25)\n")
    limit, fastest = joints.controller.arm.model.joint_speed[0], 0.0
    for _ in range(1500):
        joints.step(1)
        fastest = max(fastest, joints.controller.arm.qd[0])
    assert fastest == pytest.approx(0.25 * limit)
    assert joints.controller.arm.q[0] == pytest.approx(1.5)
    tool = Bench()
    tool.send(f"optimovel({FAR}, a=1, v=1)\n")
    tool.step(1500)
    assert tool.controller.safety.name == "NORMAL"
    assert tool.controller.arm.q[0] == pytest.approx(1.5)


def test_pause_holds_the_program_where_it_stands(bench: Bench) -> None:
    bench.send("def p():\n  write_output_integer_register(0, 1)\n  pause\n  write_output_integer_register(0, 2)\nend\n")
    bench.step(20)
    assert (bench.controller.runtime.name, bench.controller.output_ints[0]) == ("PAUSED", 1)
    assert bench.dashboard("play") == "Starting program"
    bench.step(2)
    assert bench.controller.output_ints[0] == 2


@pytest.mark.parametrize("slider", [1.0, 0.5, 0.3, 0.25])
def test_speeds_for_each_cycle_go_their_whole_way_at_any_slider(bench: Bench, slider: float) -> None:
    """As a trajectory of Universal Robots' driver: 0.2 (1 - cos(pi t)) rad in 2 s of its own time."""
    bench.send(
        "def p():\n  t = 0\n  while t < 2:\n    t = t + 0.002\n"
        "    speedj([0.2 * 3.14159265 * sin(3.14159265 * t), 0, 0, 0, 0, 0], 10, 0.002)\n"
        "    write_output_float_register(0, t)\n  end\n  stopj(10)\nend\n"
    )
    controller, start, worst = bench.controller, bench.controller.arm.q[0], 0.0
    controller.slider = slider
    cycles = 0
    while controller.runtime.name == "PLAYING" or cycles < 10:
        bench.step(1)
        cycles += 1
        wanted = 0.2 * (1.0 - math.cos(math.pi * controller.output_doubles[0]))
        worst = max(worst, abs(controller.arm.q[0] - start - wanted))
    assert worst < 0.003
    assert cycles == pytest.approx(1000 / slider, abs=10)
