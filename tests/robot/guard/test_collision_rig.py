"""Tests of the collision rig, which measures how far an arm is pushed into what it touches."""

import math

import pytest

from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.reaction.types import Reaction
from coneskin.skin.sensor import Sensor
from tests.support.collision_rig import CollisionRig, SkinOnLink
from tests.support.guard_rig import CONE, LINK, MODEL, START_Q
from tests.support.pressing_body import Body, Pressing

U, PHI = 0.13, 1.57
SKIN = SkinOnLink(Sensor(CONE.frustum, 0, name="one"), LINK, CONE)


def approach(qd: list[float], phi: float = PHI) -> float:
    """Speed of the place along its outward normal [m/s]."""
    rows = point_jacobian(MODEL, START_Q, LINK, CONE.point(U, phi))
    normal = link_pose(MODEL, START_Q, LINK).rotate(CONE.normal(phi))
    return sum(n * sum(j * v for j, v in zip(row, qd, strict=True)) for n, row in zip(normal, rows, strict=True))


def collide(qd: list[float], *bodies: Body, reaction: str = "stop") -> tuple[CollisionRig, list[Pressing]]:
    """Run into bodies."""
    rig = CollisionRig(MODEL, START_Q, qd, [SKIN], Reaction(reaction))
    return rig, rig.collide(bodies)


@pytest.mark.parametrize("speed", [0.3, 1.0])
@pytest.mark.long
def test_a_bare_stop_pushes_in_by_reaction_and_braking(speed: float) -> None:
    qd = [math.copysign(speed, approach([1.0, 0, 0, 0, 0, 0])), 0, 0, 0, 0, 0]
    _, (hit,) = collide(qd, Body("one", U, PHI))
    fast, braking = approach(qd), speed / Reaction("stop").deceleration
    # a late frame, then a late command: 5 to 12 ms; then half the speed over the braking time. The place moves on an
    # arc, which turns away from the body by up to a tenth.
    assert 0.9 * fast * (0.5 * braking + 0.005) < hit.pushed_in < fast * (0.5 * braking + 0.012)


def test_a_body_behind_the_motion_is_not_pushed() -> None:
    qd = [math.copysign(0.5, -approach([1.0, 0, 0, 0, 0, 0])), 0, 0, 0, 0, 0]
    rig = CollisionRig(MODEL, START_Q, qd, [SKIN], Reaction("stop"))
    (hit,) = rig.collide([Body("one", U, PHI, push=10.0)], longest=0.5)
    assert not math.isnan(hit.began)  # a person follows and presses, and the skin shows it
    assert "stopping" in [event.name for event in rig.events]
    assert hit.pushed_in < 1e-3


def test_a_person_presses_as_firmly_as_wanted_on_an_arm_that_stands() -> None:
    qd = [math.copysign(0.3, approach([1.0, 0, 0, 0, 0, 0])), 0, 0, 0, 0, 0]
    _, (hit,) = collide(qd, Body("one", U, PHI, push=12.0, grow_to=30.0, grow_time=0.2))
    assert hit.force == pytest.approx(30.0, abs=0.5)


@pytest.mark.long
def test_the_same_seed_is_the_same_collision() -> None:
    qd = [math.copysign(0.7, approach([1.0, 0, 0, 0, 0, 0])), 0, 0, 0, 0, 0]
    first, second = (collide(qd, Body("one", U, PHI))[0] for _ in range(2))
    assert first.events == second.events
    assert first.arm.q == second.arm.q


@pytest.mark.long
@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_a_press_over_the_seam_is_left_and_hands_beside_it_are_not_pushed(angle: float) -> None:
    """One body on the seam: the arm leaves it, as far as its own geometry tells. Two hands beside it: it only stops."""
    wrap = CONE.frustum.wrap
    joint = max(range(3), key=lambda k: abs(approach([float(k == i) for i in range(6)], 0.0)))
    speed = math.copysign(0.6, approach([float(joint == i) for i in range(6)], 0.0))
    qd = [speed * (joint == i) for i in range(6)]
    bodies = [Body("one", U, phi, stiffness=15e3, hardest=3.0) for phi in (angle, wrap - angle)]
    ways: dict[str, list[float]] = {}
    went: dict[str, list[float]] = {}
    for reaction in ("stop", "retreat"):
        rig = CollisionRig(MODEL, START_Q, qd, [SKIN], Reaction(reaction), sheets="field")
        ways[reaction] = [hit.pushed_in for hit in rig.collide(bodies)]
        went[reaction] = [hit.path[-1][1] for hit in rig.pressing]
        assert ("retreating" in [event.name for event in rig.events]) is (reaction == "retreat" and angle == 0.0)
    for own, bare in zip(ways["retreat"], ways["stop"], strict=True):
        assert own < bare + 1e-3
    if angle == 0.0:  # at the end both edges are clear of the body, which the skin's own normal has no part in
        assert max(went["retreat"]) < min(went["stop"]) - 0.02
