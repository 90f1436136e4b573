"""The simulated controller driven by the real, unmodified ur_rtde wheel. All calls run in children: see `wheel`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coneskin.robot.arm.inertia import arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import flange_jacobian, forward
from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.sim.urscript.values import pose_of, values_of

from .. import wheel

pytest.importorskip("rtde_control", reason="ur_rtde has no wheel for this Python")

HOME = (0.1, -1.4, 1.5, -1.7, -1.4, 0.2)
ARM = arm_model("ur10e")
# the wheel and the controller exchange doubles; what differs is the rounding of forward and inverse kinematics
ROUNDING = 1e-9
STOP_J = 34  # number of the command in the wheel's program


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedController]:
    log = tmp_path_factory.mktemp("sim") / "log.jsonl"
    with SimulatedController("ur10e", free_host(), HOME, log=log, unlock_after_s=1.5) as controller:
        yield controller


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[SimulatedController]:
    """One that a test may break."""
    with SimulatedController("ur10e", free_host(), HOME, log=tmp_path / "log.jsonl") as controller:
        yield controller


def stop_cycles(simulated: SimulatedController, kind: str) -> list[int]:
    """Return the duration in cycles of each stop of a kind that found the arm moving."""
    taken, begun = [], -1
    for event in simulated.events():
        if event["event"] == "motion":
            begun = event["cycle"] if event["kind"] == kind and event.get("moving", True) else -1
        elif event["event"] == "standstill" and begun >= 0:
            taken.append(event["cycle"] - begun + 1)
            begun = -1
    return taken


def move_cycles(simulated: SimulatedController, kind: str, target: list[float]) -> list[int]:
    """Return the duration in cycles of each move of a kind to a target that came to a standstill."""
    taken, begun = [], -1
    for event in simulated.events():
        if event["event"] == "motion":
            begun = event["cycle"] if event["kind"] == kind and event["target"] == pytest.approx(target) else -1
        elif event["event"] == "standstill" and begun >= 0:
            taken.append(event["cycle"] - begun + 1)
            begun = -1
    return taken


def test_receive_gets_every_variable_of_its_default_list(simulated: SimulatedController) -> None:
    got = wheel.run("receive_everything", simulated.host)
    assert got["getActualQ"] == pytest.approx(simulated.state()["q"], abs=1e-15)
    assert got["getActualTCPPose"] == pytest.approx(list(values_of(forward(ARM, got["getActualQ"]))), abs=ROUNDING)
    assert got["getActualQd"] == [0.0] * 6
    assert (got["getRobotMode"], got["getSafetyMode"], got["getRuntimeState"]) == (7, 1, 1)
    assert got["getSafetyStatusBits"] == 1
    assert got["getJointMode"] == [253] * 6
    assert got["getTargetSpeedFraction"] == 1.0
    assert got["getActualToolAccelerometer"] == [0.0, 0.0, -9.81]
    assert got["register"] == 0.0
    assert got["goes_on"]


@pytest.fixture(scope="module")
def moves(simulated: SimulatedController) -> dict[str, Any]:
    got: dict[str, Any] = wheel.run("moves", simulated.host)
    return got


@pytest.mark.long
def test_every_kind_of_move_arrives(simulated: SimulatedController, moves: dict[str, Any]) -> None:
    got = moves
    for name in ("moveJ", "moveL", "moveL_FK", "moveJ_IK"):
        returned, off = got[name]
        assert returned is True, name
        assert off < ROUNDING, name
    # the wheel writes the way points of a path with six digits
    assert got["path"][0] is True
    assert got["path"][1] < 1e-5
    assert got["tool_path"][0] is True
    assert got["tool_path"][1] < 1e-5
    # 0.15 rad at 10 rad/s2: 2 sqrt(0.15 / 10) = 0.245 s, or 122.5 cycles; a move that jumps would take fewer
    assert move_cycles(simulated, "JointLine", got["moveJ_target"])[0] == pytest.approx(123, abs=1.5)


@pytest.mark.long
def test_an_asynchronous_move_returns_at_once_and_reports_its_progress(moves: dict[str, Any]) -> None:
    returned, ran, progress, ended, off = moves["async"]
    assert (returned, ran, progress, ended) == (True, True, 0, True)
    assert off < ROUNDING
    assert moves["async_id"] == 1  # each operation has the next number


@pytest.mark.long
def test_every_stop_works_on_its_own_motion(simulated: SimulatedController) -> None:
    got = wheel.run("stops", simulated.host)
    for name, (fast, _, _, running) in got.items():
        assert fast > 0.05, f"{name}: the arm did not move"
        assert running, f"{name}: the program ended"
    assert got["stopJ after moveJ"][0] == pytest.approx(1.0)
    # 1 rad/s at 5 rad/s2 takes 0.2 s, and the call waits for it; a late controller makes up at most 0.05 s
    assert got["stopJ after moveJ"][2] > 0.15
    assert 100 in stop_cycles(simulated, "StopJoints")
    assert got["speedStop after speedJ"][0] == pytest.approx(0.5)
    # 0.2 s of acceleration at 1 m/s2 is enough for 0.1 m/s; explicit Euler drifts by the curvature, 1e-4
    assert got["speedStop after speedL"][1] == pytest.approx([0, 0.1, 0, 0, 0, 0], abs=1e-3)
    assert simulated.wait_for_standstill()["qd"] == [0.0] * 6


def test_questions_are_answered_from_the_arm_itself(simulated: SimulatedController) -> None:
    """The wheel takes a packet up variable by variable: on a busy computer it may give the answer before this one."""
    tool = [0.0, 0.02, 0.15, 0.1, 0.2, 0.3]
    asked = [0.4, -1.1, 1.2, -1.5, -1.2, 0.3]
    for tries_left in (2, 1, 0):
        got = wheel.run("questions", simulated.host, asked, tool)
        try:
            judge_the_answers(got, asked, tool)
        except AssertionError:
            if not tries_left:
                raise
        else:
            return


def judge_the_answers(got: dict[str, Any], asked: list[float], tool: list[float]) -> None:
    assert got["fk_tool"] == pytest.approx(list(values_of(forward(ARM, asked) @ pose_of(tool))), abs=ROUNDING)
    assert got["tcp_offset"] == pytest.approx(tool, abs=ROUNDING)
    here = list(values_of(forward(ARM, got["q"]) @ pose_of(tool)))
    assert got["pose"] == pytest.approx(here, abs=ROUNDING)
    assert got["fk_here"] == pytest.approx(here, abs=ROUNDING)
    assert got["flange"] == pytest.approx(list(values_of(forward(ARM, got["q"]))), abs=ROUNDING)
    assert got["ik"] == pytest.approx(got["q"], abs=1e-7)  # condition of the pose
    assert got["ik_near"] == pytest.approx(asked, abs=1e-7)
    assert got["has"] == [True, False]
    assert got["pose_within"] == [True, False]
    assert got["q_within"] == [True, False]
    assert got["steady"] is True
    assert got["step"] == 0.002
    assert got["payload"] == [1.5, [0.0, 0.0, 0.1]]
    # R_z(1) (0.1, 0, 0) + (1, 2, 3)
    assert got["trans"][:3] == pytest.approx([1 + 0.1 * math.cos(1), 2 + 0.1 * math.sin(1), 3.0])
    turning = flange_jacobian(ARM, got["q"])[3:]  # the same for every point of the hand
    by_rows = [got["jacobian"][row::6] for row in range(6)]  # the wheel gives column after column
    assert by_rows[3:] == [pytest.approx(list(row), abs=ROUNDING) for row in turning]


@pytest.mark.long
def test_slider_and_outputs(simulated: SimulatedController) -> None:
    got = wheel.run("inputs_and_outputs", simulated.host)
    assert got["bits"]
    assert got["off"]
    assert got["analog"]
    assert got["full"] == pytest.approx(1.0)
    assert got["half"] == [pytest.approx(0.5), 0.5]
    assert got["none"] == 0.0
    assert got["again"] == pytest.approx(1.0)


@pytest.mark.long
def test_a_protective_stop_holds_until_a_person_unlocks_it(simulated: SimulatedController) -> None:
    got = wheel.run("protective_stop", simulated.host)
    assert got["returned"] is False  # although it worked: the wheel sees the protective bit and gives up
    assert got["state"] == [True, 3, 1 << 2 | 1 << 10]
    assert got["runtime"] == 4
    assert got["safety"] == ["Safetymode: PROTECTIVE_STOP", "Safetystatus: PROTECTIVE_STOP"]
    assert 0.1 < got["before"] < 1.2
    assert "Cannot unlock protective stop until 5s" in got["early"]
    assert "Failed to execute: play" in got["play"]
    assert got["unlocked"]
    assert got["still"] == 0.0
    assert got["arrives"]


def test_scripts_stop_start_and_pause(simulated: SimulatedController) -> None:
    got = wheel.run("scripts", simulated.host)
    assert (got["stopped"], got["refused"]) == (False, False)
    assert got["again"] == [True, True]
    assert got["custom"] is True
    assert got["custom_q"] == [0.1, -1.5, 1.5, -1.5, -1.5, 0.0]
    assert got["paused"]
    assert got["paused_state"] == ["PAUSED rtde_control", 4, False]
    assert got["played"]
    assert got["ended"]
    assert got["ended_state"] == ["STOPPED <unnamed>", 1]


def test_all_lines_of_the_dashboard_client(simulated: SimulatedController) -> None:
    got = wheel.run("dashboard_lines", simulated.host)
    assert got["polyscopeVersion"] == "5.25.0.1"
    assert got["getSerialNumber"].isdigit()
    assert (got["isInRemoteControl"], got["running"]) == (True, False)
    assert got["isProgramSaved"] is False  # the wheel knows "True"; manual and URCL have "true"
    assert (got["robotmode"], got["off"], got["on"]) == (
        "Robotmode: RUNNING",
        "Robotmode: POWER_OFF",
        "Robotmode: RUNNING",
    )
    assert (got["safetymode"], got["safetystatus"]) == ("Safetymode: NORMAL", "Safetystatus: NORMAL")
    assert got["getRobotModel"] == "UR10"
    assert got["load"] == "File not found: a.urp"
    assert (got["play"], got["pause"]) == ("Failed to execute: play", "Failed to execute: pause")


def test_a_second_control_client_is_refused_and_the_first_unharmed(simulated: SimulatedController) -> None:
    got = wheel.run("second_control", simulated.host)
    assert "already in use" in got["refusal"]
    assert "actual_qqq" in got["unknown"]
    assert got["first"] is True


@pytest.mark.long
def test_the_watchdog_ends_the_program_that_is_not_fed(simulated: SimulatedController) -> None:
    assert wheel.run("watchdog", simulated.host) == {"fed": True, "moved": True, "ended": True, "stands": True}
    assert simulated.events("watchdog")[-1]["action"] == "stop"


def test_the_watchdog_stops_an_arm_whose_client_was_killed(simulated: SimulatedController) -> None:
    before = len(simulated.events("watchdog"))
    process = wheel.start("speed_for_ever", simulated.host)
    try:
        # on a busy computer the watchdog may have stopped it before it is looked at
        while not any(simulated.state()["qd"]) and len(simulated.events("watchdog")) == before:
            assert process.poll() is None, "the client has ended by itself"
    finally:
        process.kill()
        process.communicate()
    state = simulated.wait_for_standstill()
    assert state["runtime"] == "STOPPED"
    assert simulated.events("stopped")[-1]["reason"] == "watchdog of input_int_register_0"


def test_no_other_call_ends_the_program_but_a_pose_out_of_reach_does(fresh: SimulatedController) -> None:
    got = wheel.run("remaining_calls", fresh.host)
    here = fresh.state()["tcp"]
    assert got["waypoint"] == pytest.approx(here, abs=ROUNDING)
    assert got["contact"] == [True, False, False]
    assert (got["tool_contact"], got["history"], got["derivative"]) == (0, 6, 36)
    mass = mass_matrix(ARM, replace(arm_inertia(ARM), rotor=ZERO_VELOCITY), got["rests"])
    assert got["mass"] == pytest.approx(list(np.ravel(mass)), abs=ROUNDING)
    pairs = [got[name] for name in ("servoL", "jog", "teach", "force", "zero", "gravity", "payload")]
    assert pairs == [True, [True, True], [True, True], [True, True], True, True, True]
    assert got["freedrive"] == [True, 0, True]
    assert got["running"]
    assert (got["unreachable"], got["ended"]) == (False, True)
    assert "cannot bring its flange to (3.0000" in fresh.events("protective_stop")[-1]["reason"]


# the quirks of the wheel's own program, which runs as it is


@pytest.mark.long
def test_a_synchronous_move_swallows_a_stop_but_not_the_dashboards(simulated: SimulatedController) -> None:
    before = len(simulated.events())
    got = wheel.run("sync_move_ignores_stops", simulated.host)
    assert (got["before_stopJ"], got["before_dashboard"]) == (pytest.approx(0.5), pytest.approx(0.5))
    events = simulated.events()[before:]
    came = next(e["cycle"] for e in events if e["event"] == "received" and e["command"] == STOP_J)
    stood = next(e["cycle"] for e in events if e["event"] == "standstill")
    assert stood - came > 100  # 0.5 rad/s at 10 rad/s2 would have taken 25 cycles
    assert got["arrived"] == pytest.approx(1.5, abs=ROUNDING)
    assert got["after_dashboard"] == 0.0
    assert got["left"] > 0.1


def test_stop_j_in_speed_mode_ends_the_program(simulated: SimulatedController) -> None:
    got = wheel.run("stop_in_speed_mode", simulated.host)
    assert got == {"running": False, "stands": True, "moves": False}
    assert simulated.events("abort")[-1]["reason"].startswith("line 264: Another thread is already")


@pytest.mark.long
def test_after_one_asynchronous_stop_every_stop_j_is_a_stop_l(simulated: SimulatedController) -> None:
    before = len(simulated.events("motion"))
    wheel.run("stop_types", simulated.host)
    kinds = [e["kind"] for e in simulated.events("motion")[before:] if e.get("a") == 2.0 and "Stop" in e["kind"]]
    assert kinds == ["StopJoints", "StopTool"]
    assert stop_cycles(simulated, "StopJoints")[-1] == 250  # 1 rad/s at 2 rad/s2: 0.5 s
    # elbow and wrist against each other: the tool goes round the elbow at 0.57 m/s, and at 2 m/s2 stands in 0.29 s
    assert stop_cycles(simulated, "StopTool")[-1] == pytest.approx(143, abs=2)


def test_a_latched_speed_moves_the_arm_after_a_new_upload(simulated: SimulatedController) -> None:
    assert wheel.run("latched_speed", simulated.host) == {"stands": True, "moves": True}


def test_forward_kinematics_without_a_tool_uses_stale_registers(simulated: SimulatedController) -> None:
    asked = [0.4, -1.1, 1.2, -1.5, -1.2, 0.3]
    got = wheel.run("stale_forward_kinematics", simulated.host, asked)["fk"]
    assert math.dist(got[:3], forward(ARM, asked).translation) > 0.9  # moveJ's speed of 1.0 was taken for 1 m


# versions and faults


@pytest.mark.long
@pytest.mark.parametrize("version", ["3.15", "5.4", "5.22", "10.11"])
def test_other_versions_connect_and_move(version: str) -> None:
    with SimulatedController("ur10e", free_host(), HOME, version=version) as old:
        assert wheel.run("connect_and_move", old.host) == {"moved": True, "off": pytest.approx(0.0, abs=ROUNDING)}


@pytest.mark.long
def test_the_wheel_notices_a_frozen_controller_and_comes_back(fresh: SimulatedController) -> None:
    process = wheel.start("notice_silence", fresh.host)
    try:
        wheel.wait_for(process, "CONNECTED")
        fresh.freeze()
        wheel.wait_for(process, "NOTICED")  # by its own time-out: a frozen process closes nothing
        fresh.thaw()
        assert fresh.state()["q"] == pytest.approx(list(HOME))  # it answers, so it runs again
        said, _ = process.communicate("go on\n", timeout=60)
    finally:
        process.kill()
        process.communicate()
    got = wheel.result(said)
    assert got["again"] is True
    assert got["goes_on"]
    assert got["q"] == pytest.approx(list(HOME))


def test_the_wheel_notices_closed_connections(fresh: SimulatedController) -> None:
    process = wheel.start("notice_close", fresh.host)
    try:
        wheel.wait_for(process, "CONNECTED")
        assert fresh.call("close rtde") == 1
        said, _ = process.communicate(timeout=60)
    finally:
        process.kill()
        process.communicate()
    assert wheel.result(said) == {"noticed": True}


@pytest.mark.long
def test_a_silent_dashboard_is_an_error_after_the_wheels_time_out(fresh: SimulatedController) -> None:
    fresh.call("dashboard silent")
    got = wheel.run("silent_dashboard", fresh.host)
    assert got["refusal"]
