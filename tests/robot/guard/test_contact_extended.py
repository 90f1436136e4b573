"""What is not one disc: its centroid and the line of its contacts, once for each touch; never two invented points."""

import math
from dataclasses import replace

import pytest

from coneskin.robot.reaction.types import Reaction
from tests.support.guard_rig import CONE, GuardRig, felt, touch


def pressed(*touches):
    rig = GuardRig(*touches, reaction=Reaction("stop"), speed=1.0, follows=True).run(1.2)
    return [event for event in rig.events if event.name == "contact_extended"]


def test_two_hands_are_a_centroid_and_a_line():
    (event,) = pressed(touch(0.5, u=0.07, phi=2.0), touch(0.5, u=0.19, phi=2.0))
    details = event.details
    assert not details["location_valid"]
    assert details["u"] == pytest.approx(0.13, abs=0.005)
    half, direction = details["elongation"]
    assert math.degrees(direction) == pytest.approx(0.0, abs=2.0)
    line = details["line"]
    assert math.hypot(*line) == pytest.approx(half)
    # along the side of the cone: from the place at half as much again
    ahead = CONE.point(0.17, 2.0)
    way = [b - a for a, b in zip(CONE.point(0.09, 2.0), ahead, strict=True)]
    cosine = sum(a * b for a, b in zip(way, line, strict=True)) / math.hypot(*way) / half
    assert abs(cosine) > 0.999


def test_the_half_axes_of_the_ellipse_are_those_of_the_covariance():
    """With 95 % of a plane's normal distribution in it: the axes' outer products are 5.991 times the covariance."""
    uu, us, ss = 4e-6, 1.5e-6, 1e-6
    contact = felt(0.5)
    contact = replace(contact, touch=contact.touch._replace(covariance=(uu, us, ss)))
    half_axes = contact.details()["ellipse"]
    along, around = contact._axes(CONE.point(0.13, 1.57))
    parts = [[sum(a * b for a, b in zip(axis, way, strict=True)) for way in (along, around)] for axis in half_axes]
    (a, b), (c, d) = parts
    found = [a * a + c * c, a * b + c * d, b * b + d * d]
    assert found == pytest.approx([5.991464547 * value for value in (uu, us, ss)], rel=1e-4)
    assert math.hypot(a, b) > math.hypot(c, d)


@pytest.mark.long
def test_one_finger_is_none():
    assert pressed(touch(0.5)) == []


@pytest.mark.long
def test_hands_beside_the_seam_lie_about_it():
    wrap = CONE.frustum.wrap
    (event,) = pressed(touch(0.5, phi=0.6), touch(0.5, phi=wrap - 0.6))
    assert abs(math.remainder(event.details["phi"], 2.0 * math.pi)) < 0.05
    assert event.details["point"] == pytest.approx(CONE.point(event.details["u"], event.details["phi"]))


@pytest.mark.long
def test_a_second_touch_is_reported_anew():
    both = [touch(start, start + 0.2, u=u) for start in (0.5, 1.2) for u in (0.07, 0.19)]
    rig = GuardRig(*both, reaction=Reaction("stop"), speed=1.0).run(2.0)
    assert rig.names.count("contact_extended") == 2
