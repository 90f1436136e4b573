"""Simulated controller without sockets: programs, watchdogs, pauses, the log and the lines that it answers."""

from __future__ import annotations

import pytest

from coneskin.core.errors import KinematicsError, RobotRefused
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from tests.robot.sim.program_bench import FAR, Bench


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
    assert bench.events("abort")[0]["reason"].startswith("line 3: Another thread is already controlling")
    assert not bench.controller.arm.moving


def test_a_cb3_turns_its_programs_each_8_ms(bench: Bench) -> None:
    old = Bench(version=(3, 15))
    for made in (old, bench):
        made.send("def p():\n  write_output_float_register(0, get_steptime())\n  sleep(0.4)\nend\n")
        made.step(120)
        assert made.controller.runtime.name == "PLAYING"
        made.step(100)
        assert made.controller.runtime.name == "STOPPED"
    assert (old.controller.output_doubles[0], bench.controller.output_doubles[0]) == (0.008, 0.002)


def test_a_slider_that_is_raised_from_0_under_a_motion_gives_a_protective_stop(bench: Bench) -> None:
    def slide(fraction: float) -> str:
        bench.controller.write_inputs({"speed_slider_mask": 1, "speed_slider_fraction": fraction})
        return bench.controller.safety.name

    assert (slide(0.0), slide(1.0)) == ("NORMAL", "NORMAL")  # no program runs
    bench.send(f"def user():\n  movej({FAR}, a=5, v=1)\nend\n")
    bench.step(100)
    assert (slide(0.5), slide(1.0), slide(0.0)) == ("NORMAL",) * 3
    bench.step(200)
    assert not bench.controller.arm.moving
    assert slide(0.5) == "PROTECTIVE_STOP"


def test_a_protective_stop_can_be_unlocked_after_5_s_of_the_clock_and_not_of_cycles(bench: Bench) -> None:
    bench.controller.protective_stop("test")
    bench.step(10)
    assert not bench.controller.unlock()
    bench.controller.hold_up(5.0)
    assert bench.controller.unlock()
    assert bench.events("held_up")[0]["seconds"] == 5.0


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
    assert bench.events("abort")[0]["reason"] == "line 2: a secondary program must not move the arm in 'stopj(2)'"


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
        ("x = [1, 2]\n  y = x[5]", "line 3: a list of 2 has no element 5"),
    ],
)
def test_a_mistake_ends_the_program_and_not_the_controller(bench: Bench, line: str, reason: str) -> None:
    bench.send(f"def p():\n  {line}\nend\n")
    bench.step(20)
    assert reason in bench.events("abort")[0]["reason"]
    assert bench.controller.runtime.name == "STOPPED"


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


def test_pause_holds_the_program_where_it_stands(bench: Bench) -> None:
    bench.send("def p():\n  write_output_integer_register(0, 1)\n  pause\n  write_output_integer_register(0, 2)\nend\n")
    bench.step(20)
    assert (bench.controller.runtime.name, bench.controller.output_ints[0]) == ("PAUSED", 1)
    assert bench.dashboard("play") == "Starting program"
    bench.step(2)
    assert bench.controller.output_ints[0] == 2
