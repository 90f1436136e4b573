"""Press over the seam, from the exact field: one place on the seam, or none; never the other side of the link."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.calibration import PlaceMap
from coneskin.skin.detection.frame.contact_matrix import ContactMatrix
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.place.place_estimate import PlaceEstimator
from coneskin.skin.detection.place.seam_contact import SeamCertainty, SeamPlace
from coneskin.skin.detection.place.single_contact import CONTRADICTS, DANGEROUS_ANGLE, MOVES
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from tests.skin.detection.place.test_place_of_several_contacts import FOREARM, SHAPES, field, pressed, readings, wrong

MEAN = ContactMatrix(1e-4, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ALIKE, HARDER = 1.02e-4, 1.2e-4  # S; 2 and 20 % over the mean


@pytest.fixture
def follow():
    sensor = Sensor(Frustum(0.054, 0.054, 0.3), 1)
    certainty = SeamCertainty(sensor, DetectorSettings(), PlaceEstimator(sensor), 0.33)

    def take(conductance: float, u: float = 0.1, valid: bool = True) -> str:
        seam = SeamPlace(u, 0.0, (1e-6, 0.0, 1e-6), "", (0.01, 1.57))
        certainty._place = lambda *_: seam
        return certainty.feed(MEAN, None, 8.0, None, conductance, valid).doubt

    take.certainty = certainty
    return take


@pytest.mark.pure
def test_it_is_certain_where_it_rests_and_not_in_its_first_frame(follow):
    assert [follow(ALIKE), follow(ALIKE), follow(ALIKE, u=0.2), follow(ALIKE, u=0.2)] == [MOVES, "", MOVES, ""]


@pytest.mark.pure
def test_a_press_that_changes_is_doubted_until_it_was_certain_and_not_after(follow):
    assert [follow(ALIKE), follow(HARDER), follow(ALIKE), follow(HARDER)] == [MOVES, MOVES, "", ""]


@pytest.mark.pure
def test_after_the_touch_it_has_to_be_shown_anew(follow):
    assert [follow(ALIKE), follow(ALIKE)] == [MOVES, ""]
    follow.certainty.end()
    assert [follow(ALIKE), follow(HARDER)] == [MOVES, MOVES]


@pytest.mark.pure
def test_a_frame_that_contradicts_itself_says_so(follow):
    assert [follow(ALIKE), follow(ALIKE, valid=False)] == [MOVES, CONTRADICTS]


FULL = Frustum(0.0375, 0.0375, 0.24)
CLOSED = {"forearm": FOREARM, "full": FULL, "paper": SHAPES["paper"]}


def from_seam(sensor: Sensor, phi: float) -> float:
    """Angle from the middle of the seam, positive towards growing phi [deg]."""
    return math.degrees(math.remainder(phi + 0.5 * (2.0 * math.pi - sensor.frustum.wrap), 2.0 * math.pi))


def over_seam(cone: Frustum, u: float, forces: tuple[float, float], angle: float = 0.0) -> list[LayerContact]:
    """Presses on the D and the C side, so far from the edges [rad]; at 0 each is half a disc."""
    return [pressed(u, angle, forces[0]), pressed(u, cone.wrap - angle, forces[1])]


@pytest.mark.parametrize("shape", CLOSED)
def test_a_press_over_the_seam_is_one_certain_place_on_it(shape):
    sensor, rng = Sensor(CLOSED[shape]), random.Random(1)
    for seed in range(8):
        u = rng.uniform(0.2, 0.8) * sensor.frustum.slant
        contacts = over_seam(sensor.frustum, u, (3.0, rng.uniform(2.0, 4.0)))
        found = readings(sensor, contacts, field(), 20, seed)
        assert wrong(sensor, found, contacts) == 0
        last = found[-1]
        assert last.location_valid
        assert abs(from_seam(sensor, last.phi)) < 8.0
        assert last.u == pytest.approx(u, abs=1e-3)
        assert last.covariance is not None
        assert 0.0 < last.covariance[0] < last.covariance[2] < 0.01**2


def test_the_harder_side_draws_the_place_to_it():
    sensor = Sensor(FULL)
    for forces, sign in (((4.0, 1.5), 1.0), ((1.5, 4.0), -1.0)):
        last = readings(sensor, over_seam(FULL, 0.1, forces), field(), 20)[-1]
        assert sign * from_seam(sensor, last.phi) > 0.5


@pytest.mark.parametrize("angle", [30.0, 45.0, 60.0])
@pytest.mark.parametrize("shape", CLOSED)
def test_two_hands_beside_the_seam_are_not_certain_but_on_it(shape, angle):
    sensor = Sensor(CLOSED[shape])
    found = readings(sensor, over_seam(sensor.frustum, 0.05, (5.0, 5.0), math.radians(angle)), field(), 50)
    last = found[-1]
    assert not any(reading.location_valid for reading in found)
    assert last.doubt.startswith("it presses on both sides of the seam")
    assert abs(from_seam(sensor, last.phi)) < 1.5
    half, direction = last.elongation
    true = math.radians(angle) + 0.5 * (2.0 * math.pi - sensor.frustum.wrap)
    assert half == pytest.approx(true * sensor.frustum.radius_at(0.05), rel=0.15)
    assert abs(math.degrees(direction)) == pytest.approx(90.0, abs=3.0)


def test_the_line_across_the_seam_has_its_direction():
    sensor = Sensor(FULL)
    for ahead in (-0.02, 0.02):  # of the D side, along u
        contacts = [pressed(0.1 + 0.5 * ahead, 0.4, 5.0), pressed(0.1 - 0.5 * ahead, FULL.wrap - 0.4, 5.0)]
        last = readings(sensor, contacts, field(), 50)[-1]
        half, direction = last.elongation
        assert math.copysign(1.0, direction) == math.copysign(1.0, ahead)
        assert half * math.cos(direction) == pytest.approx(0.01, rel=0.25)


@pytest.mark.long
@pytest.mark.promise("P02")
@pytest.mark.parametrize("shape", CLOSED)
def test_no_third_contact_hides_beside_a_press_over_the_seam(shape):
    sensor, rng = Sensor(CLOSED[shape]), random.Random(2)
    cone = sensor.frustum
    for seed in range(12):
        u = rng.uniform(0.2, 0.8) * cone.slant
        away = math.radians(rng.choice((24.0, 40.0, 90.0, 170.0))) + 0.2
        third = pressed(rng.uniform(0.2, 0.8) * cone.slant, away if seed % 2 else cone.wrap - away, 2.0)
        contacts = [*over_seam(cone, u, (rng.uniform(1.0, 10.0), rng.uniform(1.0, 10.0))), third]
        assert wrong(sensor, readings(sensor, contacts, field(), 25, seed), contacts) == 0


def test_one_contact_beside_the_seam_is_where_it_is():
    sensor = Sensor(FULL)
    for side in (0.25, FULL.wrap - 0.25):
        last = readings(sensor, [pressed(0.1, side, 5.0)], field())[-1]
        assert last.location_valid
        assert last.phi == pytest.approx(side, abs=0.01)


@pytest.mark.pure  # it looks inside
def test_what_presses_beyond_the_seam_is_nearer_by_the_gap():
    sensor = Sensor(Frustum(0.054, 0.054, 0.3, math.radians(340.0)), 1)
    certainty = SeamCertainty(sensor, DetectorSettings(), PlaceEstimator(sensor), 0.33)
    angle = certainty._angle * sensor.frustum.wrap  # from the edge; from the middle of the seam 10 deg more
    assert angle + math.radians(10.0) == pytest.approx(DANGEROUS_ANGLE)


def test_a_wrap_that_does_not_close_has_no_seam():
    sensor = Sensor(SHAPES["docs"])  # 300 deg
    found = readings(sensor, over_seam(SHAPES["docs"], 0.2, (4.0, 4.0)), field(), 50)
    assert not any(reading.location_valid for reading in found)
    assert abs(from_seam(sensor, found[-1].phi)) > 90.0


@pytest.mark.parametrize("radial", ["A", "B"])
@pytest.mark.parametrize("angular", ["C", "D"])
def test_every_polarity_finds_the_seam(radial, angular):
    sensor = Sensor(FULL, polarity=Polarity(radial, angular))
    last = readings(sensor, over_seam(FULL, 0.07, (3.0, 3.0)), field(), 20)[-1]
    assert last.location_valid
    assert last.u == pytest.approx(0.07, abs=1e-3)
    assert abs(from_seam(sensor, last.phi)) < 2.0


def test_a_calibration_moves_a_seam_place_along_the_side_alone():
    shift = PlaceMap(FULL, (0.01, 0.0, 0.0, 0.0, 0.0, 0.0), (0.01, 0.0, 0.0, 0.0, 0.0, 0.0))
    last: dict[bool, TouchReading] = {}
    for mapped in (False, True):
        sensor = Sensor(FULL, place_map=shift if mapped else None)
        last[mapped] = readings(sensor, over_seam(FULL, 0.1, (3.0, 3.0)), field(), 20)[-1]
    assert last[True].u - last[False].u == pytest.approx(0.01 * FULL.slant, rel=0.02)
    assert last[True].phi == pytest.approx(last[False].phi, abs=1e-9)
