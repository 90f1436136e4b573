"""Moves of programs on the simulated controller: blends, arcs, shares of what the joints can do, times and sliders."""

from __future__ import annotations

import math

import pytest

from coneskin.robot.sim.urscript.values import values_of
from tests.robot.sim.program_bench import FAR, Bench


def test_a_time_that_is_too_short_makes_a_move_as_fast_as_it_can_be(bench: Bench) -> None:
    """As Universal Robots' client library has it in its tests: no protective stop."""
    bench.send(f"def p():\n  movej({FAR}, a=1.4, v=1.4, t=0.1)\n  write_output_integer_register(0, 1)\nend\n")
    bench.step(1500)
    assert bench.controller.safety.name == "NORMAL"
    assert bench.controller.output_ints[0] == 1
    assert bench.controller.arm.q[0] == pytest.approx(1.5)


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


@pytest.mark.long
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
    turned = (start.inverse() @ arm.tcp_pose()).rotation_vector
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


@pytest.mark.parametrize("slider", [1.0, 0.5, 0.3, 0.25])
@pytest.mark.long
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
