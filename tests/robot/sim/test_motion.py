"""The simulated arm: continuous, bounded, and it ends where it was sent."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coneskin.geometry.pose import Pose
from coneskin.robot.arm.inertia import joint_torques
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.motion.arm import (
    CONTROLLER_DECELERATION,
    CYCLE,
    Motion,
    MotionFault,
    SimulatedArm,
)
from coneskin.robot.sim.motion.motion import ServoJoints, SpeedJoints, SpeedTool, StopJoints, StopTool
from coneskin.robot.sim.motion.path import JointLine, ToolLine
from coneskin.robot.sim.urscript.values import solve_linear

ARM = arm_model("ur10e")
HOME = (0.1, -1.4, 1.5, -1.7, -1.4, 0.2)
LAW = settings(max_examples=40)


def run(
    arm: SimulatedArm, cycles: int, scale: float = 1.0, hold: bool = False
) -> list[tuple[list[float], list[float]]]:
    """The arm's positions and speeds, until it stands with nothing to do."""
    track = []
    for _ in range(cycles):
        assert arm.update(scale, hold) is None
        track.append((arm.q, arm.qd))
        if arm.motion is None and not arm.moving:
            break
    return track


def lead(values: list[float]) -> float:
    return max(abs(value) for value in values)


def off(arm: SimulatedArm, target: list[float]) -> float:
    return lead([a - b for a, b in zip(arm.q, target, strict=True)])


@pytest.mark.parametrize(("speed", "acceleration"), [(1.0, 2.0), (0.3, 5.0), (2.0, 1.0)])
def test_a_move_takes_the_time_of_its_trapezoid(speed: float, acceleration: float) -> None:
    arm = SimulatedArm(ARM, HOME)
    target = [q + 0.8 for q in HOME]
    arm.motion = JointLine(arm, target, acceleration, speed)
    cycles = len(run(arm, 5000))
    peak = min(speed, math.sqrt(0.8 * acceleration))
    # made up cycle by cycle: up to two cycles longer than the continuous one
    assert 0 <= cycles * CYCLE - (0.8 / peak + peak / acceleration) <= 2 * CYCLE + 1e-9
    assert off(arm, target) < 1e-12


def test_a_tool_line_is_straight_and_ends_at_its_pose() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.tcp = Pose.from_xyz_rpy((0.0, 0.0, 0.1), (0.0, 0.1, 0.0))
    start = arm.tcp_pose()
    p, goal_p = start.translation, [a + b for a, b in zip(start.translation, (0.2, -0.1, 0.15), strict=True)]
    goal = Pose((start @ Pose.from_xyz_rpy(rpy=(0.2, 0.1, -0.3))).rotation, (goal_p[0], goal_p[1], goal_p[2]))
    arm.motion = ToolLine(arm, goal, 1.2, 0.25)
    for q, _ in run(arm, 5000):
        here = arm.tcp_pose(q).translation
        along = math.dist(p, here) + math.dist(here, goal_p) - math.dist(p, goal_p)
        assert along < 1e-12  # rounding of inverse kinematics
    assert math.dist(arm.tcp_pose().translation, goal_p) < 1e-12


def _motions(arm: SimulatedArm) -> dict[str, Callable[[], Motion]]:
    pose = arm.tcp_pose()
    x, y, z = pose.translation
    return {
        "line": lambda: JointLine(arm, [q + 0.3 for q in HOME], 3.0, 1.0),
        "back": lambda: JointLine(arm, HOME, 3.0, 1.0),
        "tool": lambda: ToolLine(arm, Pose(pose.rotation, (x + 0.05, y, z + 0.05)), 1.0, 0.3),
        "speedj": lambda: SpeedJoints([0.2, -0.1, 0.3, 0.0, 0.1, 0.5], 3.0),
        "speedl": lambda: SpeedTool(arm, [0.05, -0.03, 0.02, 0.0, 0.1, 0.0], 1.0, 1.0),
        "servo": lambda: ServoJoints([q + 0.1 for q in HOME], 0.1, 100.0),
        "stopj": lambda: StopJoints(5.0),
        "stopl": lambda: StopTool(arm, 2.0, 5.0),
    }


@pytest.mark.long
@LAW
@given(st.integers(0, 10_000))
@example(114)  # asks the shoulder for 367 N m
def test_any_sequence_is_continuous_with_bounded_acceleration(seed: int) -> None:
    """Motions cut off at random by others, slider and holds at random."""
    draw = random.Random(seed)
    arm = SimulatedArm(ARM, HOME)
    for _ in range(8):
        motions = _motions(arm)
        arm.motion = motions[draw.choice(list(motions))]() if draw.random() < 0.9 else None
        scale, hold = draw.choice([1.0, 1.0, 0.5, 0.0]), draw.random() < 0.2
        for _ in range(draw.randint(1, 150)):
            q, qd = arm.q, arm.qd
            if fault := arm.update(scale, hold):  # more than its motors can: a controller stops it
                assert "Position deviates from path" in str(fault)
                return
            # servoj may take 40 rad/s2, and a new path may add its own acceleration to the dying speed of the last
            assert lead([a - b for a, b in zip(arm.qd, qd, strict=True)]) < 45.0 * CYCLE
            for a, b, c, d in zip(arm.q, q, arm.qd, qd, strict=True):
                # the way of one cycle is that of the mean speed, to what 45 rad/s2 can change in it
                assert abs(a - b - 0.5 * (c + d) * CYCLE) < 0.5 * 45.0 * CYCLE**2


@pytest.mark.parametrize("name", ["line", "tool", "speedj", "speedl", "servo"])
def test_a_hold_stops_every_motion_and_its_end_lets_it_go_on(name: str) -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = _motions(arm)[name]()
    run(arm, 60)
    fast = lead(arm.qd)
    assert fast > 0.01
    motion = arm.motion
    run(arm, math.ceil(fast / CONTROLLER_DECELERATION / CYCLE) + 3, hold=True)
    assert lead(arm.qd) < 1e-9
    arm.motion = motion
    run(arm, 40)
    assert lead(arm.qd) > 0.01


def test_a_stop_takes_the_leading_joints_speed_over_its_deceleration() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = SpeedJoints([1.0, 0.5, 0.0, -0.25, 0.0, 0.0], 10.0)
    run(arm, 100)
    before = arm.qd
    arm.motion = StopJoints(4.0)
    track = run(arm, 1000)
    assert len(track) == 125  # 1 rad/s / 4 rad/s2 = 0.25 s
    assert track[50][1] == pytest.approx([speed * (1 - 51 / 125) for speed in before])  # all in proportion


def test_the_slider_scales_speed_and_a_stop_does_not_wait_for_it() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = SpeedJoints([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0)
    run(arm, 200, scale=0.5)
    assert arm.qd[0] == pytest.approx(0.5)
    arm.motion = StopJoints(5.0)
    assert len(run(arm, 1000, scale=0.0)) == 50  # 0.5 rad/s / 5 rad/s2


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("speed", [1.5, -1.5, 0.4, -0.4])
@pytest.mark.long
def test_a_joint_limit_stops_the_arm_before_it_is_passed(joint: int, speed: float) -> None:
    sign = math.copysign(1.0, speed)
    limit = (ARM.joint_upper if sign > 0 else ARM.joint_lower)[joint]
    start, speeds = list(HOME), [0.0] * 6
    start[joint], speeds[joint] = limit - 0.5 * sign, speed
    arm = SimulatedArm(ARM, start)
    arm.motion = SpeedJoints(speeds, 5.0)
    faults = [fault for _ in range(1000) if (fault := arm.update(1.0, False))]
    assert faults == [fault for fault in faults if f"joint {joint + 1}" in str(fault)]
    assert [str(fault.cause) for fault in faults] == ["C150A0"]
    assert not arm.moving
    assert 0.0 <= sign * (limit - arm.q[joint]) < 0.01  # within one cycle's way of the limit


def test_speeds_beyond_a_joints_limit_are_a_fault() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = SpeedJoints([3.0, 0.0, 0.0, 0.0, 0.0, 0.0], 40.0)
    faults = [fault for _ in range(300) if (fault := arm.update(1.0, False))]
    assert "joint 1: speed 2." in str(faults[0])
    assert "above its limit 2.09" in str(faults[0])
    assert str(faults[0].cause) == "C204A5"
    assert not arm.moving


def test_a_move_is_slowed_to_what_its_joints_can_do() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = JointLine(arm, [HOME[0] + 2.0, *HOME[1:]], 20.0, 3.0)
    assert max(lead(qd) for _, qd in run(arm, 2000)) == pytest.approx(ARM.joint_speed[0])


def test_a_singular_position_stops_a_tool_speed() -> None:
    arm = SimulatedArm(ARM, (0.1, -1.4, 0.3, -1.7, -1.4, 0.2))
    arm.motion = SpeedTool(arm, [-0.05, 0.0, 0.3, 0.0, 0.0, 0.0], 1.0, 1.0)
    faults = [fault for _ in range(6000) if (fault := arm.update(1.0, False))]
    assert str(faults[0].cause) in ("C154A0", "C204A7")
    assert not arm.moving


def test_a_pose_out_of_reach_is_refused_before_the_arm_moves() -> None:
    arm = SimulatedArm(ARM, HOME)
    with pytest.raises(MotionFault, match="cannot bring its flange"):
        ToolLine(arm, Pose(translation=(3.0, 0.0, 0.0)), 1.0, 0.25)


def test_solve_solves_and_refuses_singular_equations() -> None:
    draw = random.Random(1)
    rows = [[draw.uniform(-1, 1) for _ in range(6)] for _ in range(6)]
    x = [draw.uniform(-1, 1) for _ in range(6)]
    right = [sum(a * b for a, b in zip(row, x, strict=True)) for row in rows]
    assert solve_linear(rows, right, 1e-4) == pytest.approx(x, abs=1e-11)  # condition about 1e2
    assert solve_linear([rows[0], *rows[:5]], right, 1e-4) is None
    with pytest.raises(MotionFault, match="singular"):
        SimulatedArm(ARM, (0.1, -1.4, 1.5, -1.7, 0.0, 0.2)).joint_speeds([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])  # wrist 2 at 0


def test_joint_speeds_invert_the_jacobian() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.tcp = Pose.from_xyz_rpy((0.05, -0.02, 0.2), (0.1, 0.2, 0.3))
    arm.qd = arm.joint_speeds([0.1, -0.2, 0.05, 0.3, -0.1, 0.2])
    assert arm.twist() == pytest.approx([0.1, -0.2, 0.05, 0.3, -0.1, 0.2], abs=1e-12)
    step = 1e-6  # truncation 1e-12, rounding 1e-10
    ahead = arm.tcp_pose([q + step * qd for q, qd in zip(arm.q, arm.qd, strict=True)]).translation
    behind = arm.tcp_pose([q - step * qd for q, qd in zip(arm.q, arm.qd, strict=True)]).translation
    assert [(a - b) / (2 * step) for a, b in zip(ahead, behind, strict=True)] == pytest.approx(
        [0.1, -0.2, 0.05], abs=1e-8
    )


@pytest.mark.parametrize(("lookahead", "gain"), [(0.1, 300.0), (0.2, 100.0), (0.03, 2000.0), (0.05, 600.0)])
def test_servoj_is_the_second_order_follower_of_its_gain_and_look_ahead_time(lookahead: float, gain: float) -> None:
    """A small step overshoots by exp(-pi z / sqrt(1 - z^2)), z = lookahead sqrt(gain) / 2; not at all where z >= 1."""
    arm = SimulatedArm(ARM, HOME)
    step = 1e-3  # so small that no limit acts
    arm.motion = ServoJoints([q + step for q in HOME], lookahead, gain)
    highest = 0.0
    for _ in range(2000):
        assert arm.update(1.0, False) is None
        highest = max(highest, arm.q[0] - HOME[0])
    damping = lookahead * math.sqrt(gain) / 2.0
    ideal = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)) if damping < 1.0 else 0.0
    assert highest / step - 1.0 == pytest.approx(ideal, abs=0.02)  # steps of 2 ms: 1 / 22 of the quickest time constant
    assert arm.q[0] == pytest.approx(HOME[0] + step, abs=1e-8)


def test_servoj_lags_a_moving_target_by_its_look_ahead_time() -> None:
    arm = SimulatedArm(ARM, HOME)
    arm.motion = motion = ServoJoints(HOME, 0.1, 300.0)
    speed = 0.5
    for cycle in range(1, 1001):
        target = [HOME[0] + speed * cycle * CYCLE, *HOME[1:]]
        motion.retarget(target, 0.1, 300.0)
        arm.update(1.0, False)
    assert arm.qd[0] == pytest.approx(speed, abs=1e-6)
    assert target[0] - arm.q[0] == pytest.approx(speed * 0.1, abs=speed * CYCLE)


@pytest.mark.parametrize(("gain", "step"), [(300.0, 0.34), (2000.0, 0.051), (100.0, -1.01)])
def test_a_servoj_target_that_jumps_is_a_sudden_change(gain: float, step: float) -> None:
    """What takes more than 100 rad/s2 is; what takes 40 to 100 is followed with 40 rad/s2."""
    arm = SimulatedArm(ARM, HOME)
    arm.motion = ServoJoints([*HOME[:5], HOME[5] + 0.95 * step], 0.1, gain)
    assert arm.update(1.0, False) is None
    assert arm.qdd[5] == pytest.approx(math.copysign(40.0, step))
    arm = SimulatedArm(ARM, HOME)
    arm.motion = ServoJoints([*HOME[:5], HOME[5] + step], 0.1, gain)
    fault = arm.update(1.0, False)
    assert fault is not None
    assert str(fault.cause) == "C204A1"
    assert "joint 6" in str(fault)
    assert not arm.moving


@pytest.mark.parametrize("joint", range(3))
def test_a_joint_stops_the_arm_just_beyond_what_its_motor_can_do(joint: int) -> None:
    """Of an arm that stands stretched out; faster is C153, "Position deviates from path", with the joint's number."""
    stretched = (0.0, -0.1, 0.0, -1.5, -1.5, 0.0)
    direction = [-float(i == joint) for i in range(6)]  # up, where it is the shoulder's or the elbow's
    most = SimulatedArm(ARM, stretched).feasible_acceleration(direction)
    assert 10.0 < most < 60.0
    found = []
    for share in (0.97, 1.03):
        arm = SimulatedArm(ARM, stretched)
        arm.motion = SpeedJoints(direction, share * most)
        fault = next((fault for _ in range(5) if (fault := arm.update(1.0, False))), None)
        found.append(str(fault.cause) if fault else "")
    assert found[0] == ""
    assert found[1].startswith("C153A")


@pytest.mark.parametrize("payload", [0.0, 5.0])
def test_a_stop_takes_what_torque_the_motors_have_and_no_more(payload: float) -> None:
    arm = SimulatedArm(ARM, (0.0, -0.1, 0.0, -1.5, -1.5, 0.0))
    arm.carry(payload, (0.0, 0.0, 0.1))
    arm.motion = SpeedJoints([1.0, 0.5, 0.0, 0.0, 0.0, 0.0], 4.0)
    run(arm, 150)
    arm.motion, shares = StopJoints(60.0), []
    while arm.moving:
        before = arm.q, arm.qd
        assert arm.update(1.0, False) is None
        torques = joint_torques(ARM, arm.inertia, *before, arm.qdd)
        held = [1.0 if speed else 1.25 for speed in before[1]]  # a joint at rest withstands more
        shares.append(max(abs(t) / limit / h for t, limit, h in zip(torques, arm.inertia.torque, held, strict=True)))
    assert max(shares[:-1]) <= 1.05  # it is worked out anew each fourth cycle
    assert shares[1] >= 0.9  # and it is used
    assert len(shares) > 1.0 / 60.0 / 0.002


#: arm, joint -> distance [rad] and time [s] of a stop of category 0; user manuals UR5/CB3 3.4.5, UR3/CB3 3.10
PUBLISHED_STOPS = {("UR5", 0): (0.31, 0.244), ("UR5", 1): (0.70, 0.530), ("UR5", 2): (0.22, 0.164)}
PUBLISHED_STOPS |= {("UR3", 0): (0.18, 0.159), ("UR3", 2): (0.15, 0.092)}


@pytest.mark.parametrize(("name", "joint"), PUBLISHED_STOPS)
def test_a_stop_of_category_0_is_as_long_as_published(name: str, joint: int) -> None:
    """Stretched out, highest payload, 183 deg/s, downwards. The UR3's shoulder is left out: its stop is too short
    for its published torque (`python -m bench stopping-times`)."""
    found = []
    for way in (-1.0, 1.0):
        arm = SimulatedArm(arm_model(name), (0.0,) * 6)
        arm.carry({"UR5": 5.0, "UR3": 3.0}[name], (0.0, 0.0, 0.0))
        arm.category_0 = True
        arm.qd[joint] = way * math.radians(183.0)
        time = 0.002 * len(run(arm, 1000))
        found.append((abs(arm.q[joint]), time))
    assert max(found) == pytest.approx(PUBLISHED_STOPS[name, joint], rel=0.2)


def test_a_move_in_too_short_a_time_goes_as_fast_as_its_motors_can() -> None:
    arm = SimulatedArm(ARM, (0.0, -0.1, 0.0, -1.5, -1.5, 0.0))
    target = [0.8, -0.4, 0.5, -1.0, -1.0, 0.5]
    arm.motion = JointLine(arm, target, 1.4, 1.05, time=0.05)
    run(arm, 2000)
    assert off(arm, target) < 1e-12
