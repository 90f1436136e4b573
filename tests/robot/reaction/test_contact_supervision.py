"""What ends a motion away: a touch whose place is doubtful, by more than one frame."""

from dataclasses import replace

from coneskin.robot.arm.models import arm_model
from coneskin.robot.reaction.contact_supervision import ContactSupervision
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
