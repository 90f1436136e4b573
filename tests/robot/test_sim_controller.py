"""The simulated controller without sockets: programs, safety, watchdog, registers, the dashboard's lines."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest

from coneskin.errors import KinematicsError, RobotRefused
from coneskin.robot.sim_builtins import Builtins
from coneskin.robot.sim_controller import Controller
from coneskin.robot.sim_dashboard import answer
from coneskin.robot.sim_options import Options
from coneskin.robot.sim_urscript import translate

FAR = "[1.5, -1.5708, 1.5708, -1.5708, -1.5708, 0]"


class Bench:
    """A controller, its log, and what a test does with it."""

    def __init__(self, **options: Any) -> None:
        self.text = io.StringIO()
        self.controller = Controller(Options(**options), self.text)

    def send(self, text: str) -> None:
        made = translate(text, Builtins.names(), Builtins.blocking())
        if not made.secondary:
            self.controller.arriving()
        self.controller.load(made)

    def step(self, cycles: int) -> None:
        for _ in range(cycles):
            self.controller.step()

    def events(self, kind: str) -> list[dict[str, Any]]:
        lines = [json.loads(line) for line in self.text.getvalue().splitlines()]
        return [line for line in lines if line["event"] == kind]

    def dashboard(self, line: str) -> str:
        return answer(self.controller, line, lambda: False)


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
    assert bench.controller.runtime.name == "STOPPED"


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
        bench.controller.received({"input_int_register_0": 0})
    assert bench.controller.runtime.name == "PLAYING"
    bench.step(45)
    bench.controller.received({"input_double_register_0": 1.0})
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
    bench.controller.received({"input_int_register_0": 34, "input_double_register_0": 2.0})
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
        ("movel(p[9, 0, 0, 0, 0, 0])", "cannot bring its flange"),
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


def test_a_speed_that_is_not_a_number_does_not_reach_the_arm(bench: Bench) -> None:
    bench.send("def p():\n  speedj([read_input_float_register(0), 0, 0, 0, 0, 0], 1)\nend\n")
    bench.controller.received({"input_double_register_0": float("nan")})
    bench.step(20)
    assert "joint speeds must be finite" in bench.events("abort")[0]["reason"]
    assert not bench.controller.arm.moving
