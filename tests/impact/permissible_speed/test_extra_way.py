from __future__ import annotations

import math
import random
from itertools import permutations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from coneskin.impact.permissible_speed.arm_patches import ArmPatch, patches_of
from coneskin.impact.permissible_speed.extra_way import (
    BODY_RADIUS,
    ExtraWay,
    _levers_and_changes,
    _worst_bend,
    _worst_lag,
    extra_ways,
)
from coneskin.impact.permissible_speed.limits_file import BodyRegion, ForceLimits, MeasuredReaction
from coneskin.impact.permissible_speed.speed_map import contact_at
from coneskin.impact.permissible_speed.two_mass_contact import StruckBody
from coneskin.robot.arm.inertia import arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.scene.reader import parse_scene
from coneskin.skin.materials import Padding
from tests.support.scenes import forearm_scene

MODEL = arm_model("UR5e")
TURN = 2.0 * math.pi * 15.0
Q = (0.3, -1.2, 1.1, -0.4, 0.7, 0.2)


def positions(count: int) -> list[tuple[float, ...]]:
    chance = random.Random(5)
    return [tuple(chance.uniform(-math.pi, math.pi) for _ in range(6)) for _ in range(count)]


def masses_at(q: tuple[float, ...]) -> NDArray[np.float64]:
    return np.array(mass_matrix(MODEL, arm_inertia(MODEL), q))


def patches(link: int = 3) -> list[ArmPatch]:
    found = patches_of(parse_scene(forearm_scene()))[::5]
    return [ArmPatch(p.sensor, link, p.u, p.phi, p.point, p.normal) for p in found]


def test_joints_that_do_not_pull_at_each_other_leave_no_lag() -> None:
    levers, _ = _levers_and_changes(MODEL, Q, 3, patches())
    masses = masses_at(Q)
    assert _worst_lag(levers, np.diag(np.diag(masses))) == pytest.approx(0.0, abs=1e-15)
    assert _worst_lag(levers, masses).min() > 1e-3


def test_the_worst_does_not_depend_on_the_order_of_the_joints() -> None:
    levers, changes = _levers_and_changes(MODEL, Q, 3, patches())
    masses = masses_at(Q)
    for order in list(permutations(range(6)))[::97]:
        at = np.ix_(order, order)
        assert _worst_lag(levers[:, order], masses[at]) == pytest.approx(_worst_lag(levers, masses))
        assert _worst_bend(changes[:, at[0], at[1]]) == pytest.approx(_worst_bend(changes))


def overshoot(
    levers: NDArray[np.float64], masses: NDArray[np.float64], directions: NDArray[np.float64], braking: float
) -> float:
    """Return the farthest that six joints on their servos go beyond where they are to be, braking for a time [s]."""
    inertia = np.diag(masses)
    back = np.linalg.inv(masses)
    step = 2e-4
    motion = np.zeros((13, 13))  # of lags, their rates, and a constant
    motion[:6, 6:12] = np.eye(6)
    motion[6:12, :6] = -back * (inertia * TURN**2)
    motion[6:12, 6:12] = -back * (2.0 * inertia * TURN)
    motion[6:12, 12] = directions
    braked = expm(motion * step)
    motion[6:12, 12] = 0.0
    stands = expm(motion * step)
    state, farthest = np.zeros(13), 0.0
    state[12] = 1.0
    for count in range(round((braking + 0.1) / step)):
        state = (braked if count * step < braking else stands) @ state
        farthest = max(farthest, float(levers @ state[:6]))
    return farthest


def test_the_lag_is_what_six_joints_on_their_servos_overshoot_by_beyond_one() -> None:
    """A long braking, in the worst direction; integrated without any of the code that is tested."""
    for q in positions(4):
        levers, _ = _levers_and_changes(MODEL, q, 3, patches()[:2])
        masses = masses_at(q)
        for lever, lag in zip(levers, _worst_lag(levers, masses), strict=True):
            pulled = lever @ (masses / np.diag(masses)[:, None])
            direction = np.sign(pulled - lever)
            state = np.linalg.solve(np.diag(np.diag(masses)) * TURN**2, masses @ direction)
            assert TURN**2 * float(lever @ state) - float(lever @ direction) == pytest.approx(lag)
            found = overshoot(lever, masses, direction, 1.0)
            assert TURN**2 * found >= (lag + float(lever @ direction)) * (1.0 - 1e-4)


def test_a_delay_is_that_of_a_critically_damped_servo_and_of_a_long_braking() -> None:
    """At w = 20 rad/s a blow of 1 rad/s moves the servo by 1 / (20 e) rad; 2 rad/s^2 for long, by 2 / 20^2 rad."""
    way = ExtraWay(3.0)
    assert way.delay(0.5, 0.25, 1e9, 20.0) == pytest.approx(3.0 / (20.0 * math.e * 0.25), rel=1e-12)
    assert way.delay(0.5, 0.25, 2.0, 20.0) == pytest.approx(3.0 * 2.0 / 400.0 / 0.5, rel=1e-12)
    assert way.delay(0.0, 0.25, 2.0, 20.0) == 0.0


@pytest.mark.long
def test_a_delay_makes_up_for_the_lag_also_of_a_short_braking() -> None:
    """What six joints overshoot by is at most what one does, and the way of the delay; but for what they swing."""
    worst = -math.inf
    for q in positions(12):
        levers, _ = _levers_and_changes(MODEL, q, 3, patches()[:4])
        masses = masses_at(q)
        for row, lag in zip(levers, _worst_lag(levers, masses), strict=True):
            joint = int(np.argmax(np.abs(row)))
            direction = np.zeros(6)
            direction[joint] = math.copysign(1.0, row[joint])
            lever = float(row @ direction)
            for braking in (0.002, 0.01, 0.04, 0.3):
                six = overshoot(row, masses, direction, braking)
                one = overshoot(row, np.diag(np.diag(masses)), direction, braking)
                speed = lever * braking  # of a deceleration of 1 rad/s^2
                delay = ExtraWay(float(lag)).delay(speed, lever, 1.0, TURN)
                worst = max(worst, (six - one - speed * delay) / one)
    assert worst < 0.05


def test_the_changes_of_the_levers_are_those_of_a_ball_that_comes_nearer() -> None:
    step = 1e-3
    for link in (2, 3, 6):
        for patch in patches(link)[:3]:
            _, (changes,) = _levers_and_changes(MODEL, Q, link, [patch])
            pose = link_pose(MODEL, Q, link)
            centre = np.array(pose.apply(patch.point)) + BODY_RADIUS * np.array(pose.rotate(patch.normal))

            def nearer(at: NDArray[np.float64], patch: ArmPatch = patch, centre: NDArray[np.float64] = centre) -> float:
                pose = link_pose(MODEL, at.tolist(), patch.link)
                return float(np.array(pose.rotate(patch.normal)) @ (np.array(pose.apply(patch.point)) - centre))

            joints, q = step * np.eye(6), np.array(Q)
            for a, b in ((0, 0), (0, 1), (1, 2), (2, 2), (1, link - 1)):
                corners = (
                    nearer(q + joints[a] + joints[b])
                    - nearer(q + joints[a] - joints[b])
                    - nearer(q - joints[a] + joints[b])
                    + nearer(q - joints[a] - joints[b])
                )
                assert changes[a, b] == pytest.approx(corners / (4.0 * step**2), abs=1e-6)


def test_no_direction_bends_more_than_the_worst() -> None:
    chance = np.random.default_rng(2)
    directions = np.vstack((chance.uniform(-1.0, 1.0, (500, 6)), chance.choice([-1.0, 1.0], (500, 6))))
    for q in positions(5):
        _, changes = _levers_and_changes(MODEL, q, 5, patches(5)[:3])
        bends = np.einsum("di,pij,dj->pd", directions, changes, directions)
        assert np.all(bends.max(axis=1) <= _worst_bend(changes) + 1e-12)
    convex = np.array([[[2.0, -1.0], [-1.0, 3.0]]])
    assert _worst_bend(convex) == pytest.approx([7.0])  # at (1, -1)
    assert _worst_bend(-np.eye(2)[None]) == pytest.approx([0.0])  # standing still


def test_a_straight_way_with_the_mean_lever_is_ahead_of_the_bent_one_and_ends_with_it() -> None:
    bend, lever, angle = 0.8, 0.1, 0.4
    straight = lever * ExtraWay(bend=bend).stretch(angle, lever)
    for share in (0.1, 0.5, 0.9):
        at = share * angle
        assert straight * at > lever * at + 0.5 * bend * at * at
    assert straight * angle == pytest.approx(lever * angle + 0.5 * bend * angle * angle)


def test_a_contact_takes_the_extra_way() -> None:
    region = BodyRegion("hand", StruckBody(0.6, support=20e3), ForceLimits(150.0, 120.0))
    measured = MeasuredReaction(0.012, 9.0, "a test")
    plain = contact_at(0.2, 0.1, 8.0, region, measured, Padding())
    assert contact_at(0.2, 0.1, 8.0, region, measured, Padding(), ExtraWay()) == plain
    lagging = contact_at(0.2, 0.1, 8.0, region, measured, Padding(), ExtraWay(lag=0.5))
    turn = 2.0 * math.pi * 17.0
    assert lagging.arm.speed == plain.arm.speed
    assert (lagging.arm.reaction - 0.012) * 0.2 == pytest.approx(0.5 * 9.0 / turn**2)
    bent = contact_at(0.2, 0.1, 8.0, region, measured, Padding(), ExtraWay(bend=0.5))
    angle = plain.way_to_close / 0.1 + 2.0 * 0.012 + 2.0**2 / 18.0
    assert bent.arm.speed == pytest.approx(0.2 * (1.0 + 0.25 * angle / 0.1))
    assert bent.arm.deceleration / bent.arm.speed == pytest.approx(plain.arm.deceleration / plain.arm.speed)
    assert math.isfinite(contact_at(5.0, 0.02, 8.0, region, measured, Padding(), ExtraWay(3.0, 9.0)).arm.speed)


def test_the_ways_are_the_most_of_the_positions_and_are_rounded_up() -> None:
    own, some = patches(), positions(3)
    together = extra_ways(MODEL, own, some)
    apart = [extra_ways(MODEL, own, [q]) for q in some]
    for number, way in enumerate(together):
        assert way.lag == max(ways[number].lag for ways in apart)
        assert way.bend == max(ways[number].bend for ways in apart)
        up = way.rounded_up()
        assert way.lag <= up.lag
        assert way.bend <= up.bend
        assert up.rounded_up() == up
        assert up.up_to(way) == way
    assert ExtraWay().rounded_up() == ExtraWay()
    assert ExtraWay(50.0, 60.0).rounded_up() == ExtraWay(50.0, 60.0)
