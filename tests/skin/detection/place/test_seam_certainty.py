"""Certainty of a press over the seam: from frame to frame it has to rest, and to press alike until it was certain."""

from types import SimpleNamespace

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.contact_matrix import ContactMatrix
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.place.doubt import CONTRADICTS, MOVES
from coneskin.skin.detection.place.place_estimate import PlaceEstimator
from coneskin.skin.detection.place.seam_certainty import SeamCertainty
from coneskin.skin.detection.place.seam_contact import SeamPlace
from coneskin.skin.sensor import Sensor

MEAN = ContactMatrix(1e-4, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ALIKE, HARDER = 1.02e-4, 1.2e-4  # S; 2 and 20 % over the mean


@pytest.fixture
def follow():
    sensor = Sensor(Frustum(0.054, 0.054, 0.3), 1)
    certainty = SeamCertainty(sensor, DetectorSettings(), PlaceEstimator(sensor), 0.33)

    def take(conductance: float, u: float = 0.1, valid: bool = True) -> str:
        seam = SeamPlace(u, 0.0, (1e-6, 0.0, 1e-6), "", (0.01, 1.57))
        certainty._test = SimpleNamespace(place=lambda *_: seam)
        return certainty.follow(MEAN, None, 8.0, None, conductance, valid).doubt

    take.certainty = certainty
    return take


def test_it_is_certain_where_it_rests_and_not_in_its_first_frame(follow):
    assert [follow(ALIKE), follow(ALIKE), follow(ALIKE, u=0.2), follow(ALIKE, u=0.2)] == [MOVES, "", MOVES, ""]


def test_a_press_that_changes_is_doubted_until_it_was_certain_and_not_after(follow):
    assert [follow(ALIKE), follow(HARDER), follow(ALIKE), follow(HARDER)] == [MOVES, MOVES, "", ""]


def test_after_the_touch_it_has_to_be_shown_anew(follow):
    assert [follow(ALIKE), follow(ALIKE)] == [MOVES, ""]
    follow.certainty.end()
    assert [follow(ALIKE), follow(HARDER)] == [MOVES, MOVES]


def test_a_frame_that_contradicts_itself_says_so(follow):
    assert [follow(ALIKE), follow(ALIKE, valid=False)] == [MOVES, CONTRADICTS]
