"""What ends a motion away, at which limit: a touch that is doubtful, nearer, firmer, elsewhere or not lighter."""

import math
from dataclasses import replace

import pytest
from scipy.optimize import brentq

from coneskin.robot.arm.kinematics import place_point
from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.arm.workspace import reach
from coneskin.robot.reaction.contact_supervision import ContactApproach, ContactSupervision, clamped
from coneskin.robot.reaction.types import ContactOnLink

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
TOUCH = ContactOnLink(3, (0.2, 0.0, 0.05), (0.0, 0.0, 1.0), 0.8, True, 0.1, 1)
LOST = replace(TOUCH, level=0.5, location_valid=False)
FADING = replace(LOST, level=0.49)
NOT_CERTAIN = "the place of the touch is not certain any more"


def reasons(*seen):
    supervision = ContactSupervision(arm_model("UR5e"), Q, [TOUCH])
    return [supervision.resistance(time, Q, [contact]) for time, contact in seen]


def test_a_doubt_of_several_frames_ends_it():
    assert reasons((1.0, LOST), (1.003, FADING), (1.004, FADING)) == ["", "", NOT_CERTAIN]


def test_a_doubt_of_one_frame_does_not_however_late_a_busy_computer_reads_the_next():
    assert reasons((1.0, LOST), (1.03, LOST), (1.031, TOUCH), (1.032, FADING)) == ["", "", "", ""]
    assert reasons((1.0, LOST), (1.03, LOST), (1.031, FADING)) == ["", "", NOT_CERTAIN]
    assert reasons((1.0, LOST), (1.049, LOST), (1.051, LOST)) == ["", "", NOT_CERTAIN]  # or of a skin without noise


def test_a_light_touch_needs_no_place():
    light = replace(LOST, level=LOST.firm - 0.01)
    assert reasons((1.0, light), (1.1, replace(light, level=0.1))) == ["", ""]


def away(metres):
    """Joint positions at which the touched surface has moved so far against its normal."""
    model = arm_model("UR5e")
    start, normal, _ = place_point(model, Q, TOUCH.link, TOUCH.point, TOUCH.normal)

    def missing(turn):
        point = place_point(model, (turn, *Q[1:]), TOUCH.link, TOUCH.point).point
        return sum((a - b) * n for a, b, n in zip(start, point, normal, strict=True)) - metres

    return (brentq(missing, -0.1, 0.1), *Q[1:])


def ended(*seen, bare=False):
    """The reason after the last of (time, way of the surface [m], touch)."""
    supervision = ContactSupervision(arm_model("UR5e"), Q, [TOUCH], bare=bare)
    return [supervision.resistance(time, away(way), [contact]) for time, way, contact in seen][-1]


def level(value):
    return replace(TOUCH, level=value)


def test_each_limit_of_a_motion_away_is_where_its_words_say() -> None:
    """Just below each it goes on, just above it ends: 1 mm nearer, 20 mm aside, 0.01 firmer, 50 ms no lighter."""
    assert ended((0.0, -0.9e-3, TOUCH)) == ""
    assert ended((0.0, -1.1e-3, TOUCH)) == "the surface has moved 1.1 mm towards the touch"
    x, y, z = TOUCH.point
    assert ended((0.0, 0.0, replace(TOUCH, point=(x + 0.019, y, z)))) == ""
    assert ended((0.0, 0.0, replace(TOUCH, point=(x + 0.021, y, z)))) == "the place of the touch has jumped by 21 mm"
    assert ended((0.0, 0.0, TOUCH), (0.01, 0.9e-3, level(0.9)), (0.02, 0.9e-3, level(1.0))) == ""  # it has not left yet
    left = (0.0, 1.1e-3, TOUCH)
    assert ended(left, (0.01, 2e-3, level(TOUCH.level + 0.009))) == ""
    assert ended(left, (0.01, 2e-3, level(TOUCH.level + 0.011))) == "the touch becomes firmer"
    assert ended(left, (0.049, 4e-3, TOUCH)) == ""
    why = "the touch does not become lighter, though the surface has moved away by 4.0 mm"
    assert ended(left, (0.051, 4e-3, TOUCH)) == why
    slow, fast = level(TOUCH.level - 0.009), level(TOUCH.level - 0.011)
    assert ended(left, (0.03, 3e-3, slow), (0.06, 4e-3, slow)) == why
    assert ended(left, (0.03, 3e-3, fast), (0.06, 4e-3, fast)) == ""


def test_where_a_bare_side_may_lead_the_touch_has_to_become_lighter_sooner() -> None:
    way = (0.0, 0.6e-3, TOUCH), (0.051, 0.7e-3, TOUCH)
    assert ended(*way) == ""
    assert ended(*way, bare=True).startswith("the touch does not become lighter")


@pytest.mark.parametrize(("degrees", "held"), [(59.0, False), (61.0, True)])
def test_normals_more_than_60_degrees_apart_may_hold_the_arm(degrees, held) -> None:
    turn = math.radians(degrees)
    other = replace(TOUCH, normal=(math.sin(turn), 0.0, math.cos(turn)), number=2)
    assert clamped([TOUCH, other]) is held


@pytest.mark.parametrize(("ratio", "too_far"), [(3.9, False), (4.1, True)])
def test_without_a_place_any_point_may_move_four_times_as_far(ratio, too_far) -> None:
    model = arm_model("UR5e")
    approach = ContactApproach(model, Q, ZERO_VELOCITY, 10.0, press=1e-3)
    turn = ratio * 1e-3 / reach(model)[0]
    approach.update((turn, *Q[1:]), ZERO_VELOCITY, [replace(TOUCH, link=1, location_valid=False)])
    assert (approach.exceeded[0] == TOUCH.number) is too_far
