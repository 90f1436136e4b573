"""A retreat that presses on something: bodies of their own geometry, whatever the skin reads; beside a bare stop."""

import math
from dataclasses import replace

import pytest

from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.guard.phase import Phase
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.skin.sensor import Sensor
from tests.support.collision_rig import CollisionRig, SkinOnLink
from tests.support.guard_rig import CONE, LINK, MODEL, START_Q
from tests.support.pressing_body import Body
from tests.support.sweep import sweep

QD = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
U = 0.13


def towards() -> float:
    """The azimuth that runs into something [rad]."""
    rows = point_jacobian(MODEL, START_Q, LINK, CONE.point(U, 0.0))
    pose = link_pose(MODEL, START_Q, LINK)

    def approach(phi: float) -> float:
        return sum(n * row[0] for n, row in zip(pose.rotate(CONE.normal(phi)), rows, strict=True))

    return max((math.radians(angle) for angle in range(20, 340, 2)), key=approach)


PHI = towards()
HAND = Body("one", U, PHI, stiffness=20e3, hardest=60.0)


def collide(reaction: Reaction, *bodies: Body, heeds: bool = True) -> CollisionRig:
    skin = SkinOnLink(Sensor(CONE.frustum, 0, name="one"), LINK, CONE)
    rig = CollisionRig(MODEL, START_Q, QD, [skin], reaction, heeds=heeds)
    rig.collide(bodies)
    return rig


def excess(rig: CollisionRig, *bodies: Body) -> float:
    """How much farther than in a bare stop the surface was moved into any of them [m]."""
    bare = collide(Reaction("stop"), *bodies)
    return max(own.pushed_in - stop.pushed_in for own, stop in zip(rig.pressing, bare.pressing, strict=True))


def event(rig: CollisionRig, name: str):
    return next(item for item in rig.events if item.name == name)


def opposite(gap: float) -> Body:
    """A second hand on the other side of the same skin, that the retreat comes to after a way [m]."""
    return Body("one", U, (PHI + math.pi) % (2 * math.pi), 0.05, gap, 20e3, hardest=200.0)


@pytest.mark.long
def test_a_retreat_from_one_hand_is_made():
    rig = collide(Reaction("retreat", distance=0.03), HAND)
    assert event(rig, "retreated").details["complete"] is True


@pytest.mark.promise("P31")
@pytest.mark.long  # three collisions and their bare stops take a second or two
@pytest.mark.parametrize("distance", [0.06, 0.3])
def test_a_second_hand_opposite_on_the_same_skin_is_not_pushed(distance):
    """57 mm and 135 mm into it before, with these two settings."""
    reaction = Reaction("retreat", distance=distance, arm_distance=1.0)
    follows = replace(HAND, push=5.0)  # the first hand stays on the skin, so that the second one is no new touch
    for bodies in ((follows, opposite(0.01)), (HAND, opposite(0.02)), (follows, opposite(0.0))):
        assert excess(collide(reaction, *bodies), *bodies) < 0.002


class LaggingRig(CollisionRig):
    """A reader that falls behind as soon as the arm moves away."""

    def _step(self) -> None:
        if self.is_in(Phase.RETREATING):
            self.lag = 0.2
        super()._step()


@pytest.mark.promise("P31")
@pytest.mark.parametrize("kind", sweep(["retreat", "comply"]))
@pytest.mark.long
def test_what_is_seen_too_late_ends_a_motion_away_whatever_the_scene_permits(kind):
    """Up to 9.8 mm farther into a second hand before, where frames came up to 0.25 s late."""
    skin = SkinOnLink(Sensor(CONE.frustum, 0, name="one"), LINK, CONE)
    bodies = (replace(HAND, push=5.0), opposite(0.0))
    patient = MonitoringLimits(skin_silence=0.25)
    rig = LaggingRig(MODEL, START_Q, QD, [skin], Reaction(kind, distance=0.06, arm_distance=1.0), limits=patient)
    rig.collide(bodies)
    assert "too old to move away by (50 ms at most" in event(rig, "retreated").details["why"]
    assert event(rig, "retreated").details["complete"] is False
    assert excess(rig, *bodies) < 0.005


@pytest.mark.long
@pytest.mark.promise("P31")
@pytest.mark.parametrize("force", [5.0, 20.0, 100.0])
def test_a_press_that_grows_ends_the_retreat(force):
    press = replace(HAND, push=2.0, grow_to=force, grow_time=0.3, push_speed=0.4, hardest=200.0)
    rig = collide(Reaction("retreat"), press)
    assert event(rig, "retreated").details["complete"] is False
    assert excess(rig, press) < 0.002
