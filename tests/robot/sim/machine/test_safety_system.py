"""Safety system of the simulated controller: stops, safeguard, reduced mode, motion that no arm can follow."""

from __future__ import annotations

import pytest

from coneskin.robot.sim.machine.states import ErrorNotice
from tests.robot.sim.program_bench import FAR, Bench


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
    bench.dashboard("restart safety")
    assert bench.dashboard("robotmode") == "Robotmode: RUNNING", "there is nothing to end"


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
