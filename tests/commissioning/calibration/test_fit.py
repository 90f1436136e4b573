"""The fit of a place map: what it recovers, what it leaves alone, what it leaves out, and what it refuses."""

import math
import random
from collections.abc import Callable

import pytest

from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.calibration.fit import CalibrationFit, KnownTouch, fit_map
from coneskin.commissioning.misreadings import WRONG, Place, misread
from coneskin.core.errors import SkinError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.calibration import PlaceMap
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import FILM_SHEETS

FOREARM = Frustum(0.0376, 0.0372, 0.26, math.radians(350.0))
PAPER = Frustum(0.025, 0.05, 0.0968, 6.0)  # its radii double, as those of the paper's sector
SENSORS = [Sensor(FOREARM), Sensor(PAPER, polarity=Polarity("A", "D"))]
AFFINE = PlaceMap(FOREARM, (0.004, -0.012, 0.02, 0.0, 0.0, 0.0), (-0.006, 0.02, -0.01, 0.0, 0.0, 0.0))
BENT = ((0.004, -0.012, 0.0, 0.03, 0.08, -0.06), (-0.006, 0.02, 0.0, -0.05, 0.04, 0.07))
COATED = ((0.0, 0.0, 0.0, 0.0, 0.17, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, -0.17))  # as few are
Bends = tuple[tuple[float, ...], tuple[float, ...]]
PRECISE = 1e-6  # m; marks so well placed that no prior counts


def touched(
    sensor: Sensor, reads: Callable[[Place], Place], count: int = 9, sigma: float = 0.0, seed: int = 0
) -> list[KnownTouch]:
    """Touches of all marks, each placed with an error, and read in some way."""
    rng = random.Random(seed)
    cone = sensor.frustum
    found = []
    marks = _calibration_marks(sensor, count)
    assert len(marks) == count
    for mark in marks:
        true = Place(mark.u + rng.gauss(0.0, sigma), mark.phi + rng.gauss(0.0, sigma) / cone.radius_at(mark.u))
        found.append(KnownTouch(mark.place, reads(true)))
    return found


def through(place_map: PlaceMap) -> Callable[[Place], Place]:
    """The reading that a map takes back."""
    return lambda place: Place(*place_map.invert(*place))


def distance(cone: Frustum, place: tuple[float, float], other: tuple[float, float]) -> float:
    return math.hypot(place[0] - other[0], cone.radius_at(other[0]) * math.remainder(place[1] - other[1], math.tau))


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("count", [4, 9, 16])
def test_offset_gain_and_shear_are_recovered(sensor: Sensor, count: int) -> None:
    true = PlaceMap(sensor.frustum, AFFINE.along, AFFINE.around)
    fit = fit_map(sensor, touched(sensor, through(true), count), PRECISE)
    room = 2e-5 if count > 4 else 1e-3  # four marks do not exclude a film's bends, of which they are near the rims
    assert fit.place_map.along == pytest.approx(true.along, abs=room)
    assert fit.place_map.around == pytest.approx(true.around, abs=room)
    assert fit.before.rms > 1e-3
    assert all(fit.used)


def test_a_mark_that_is_read_across_the_seam_is_as_far_off_as_it_looks() -> None:
    """Three of nine, turned by 12 deg, are read beyond the edge of a full wrap: that is no error of nearly a turn."""
    sensor = Sensor(Frustum(0.0375, 0.0375, 0.24))
    turned = PlaceMap(sensor.frustum, (0.0,) * 6, (12.0 / 360.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    marks = [(u, phi) for u in (0.03, 0.12, 0.21) for phi in (0.1, 2.2, 4.3)]
    touches = [KnownTouch(Place(u, phi), Place(u, (phi - math.radians(12.0)) % math.tau)) for u, phi in marks]
    assert sum(touch.read.phi > touch.mark.phi for touch in touches) == 3
    fit = fit_map(sensor, touches, PRECISE)
    assert fit.place_map.around == pytest.approx(turned.around, abs=2e-5)
    assert all(fit.used)


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("bends", [BENT, COATED])
@pytest.mark.long
def test_a_bend_is_recovered_where_there_are_enough_touches(sensor: Sensor, bends: Bends) -> None:
    true = PlaceMap(sensor.frustum, *bends)
    fit = fit_map(sensor, touched(sensor, through(true), 16), PRECISE)
    assert (fit.along, fit.around) == ("offset, gain, shear and bend", "offset, gain, shear and bend")
    assert fit.place_map.along == pytest.approx(true.along, abs=2e-5)
    assert fit.place_map.around == pytest.approx(true.around, abs=2e-5)


def judged(sensor: Sensor, fit: CalibrationFit, reads: Callable[[Place], Place], rng: random.Random) -> float:
    """Root mean square error at places that were not touched [m]."""
    cone, squares = sensor.frustum, []
    for _ in range(40):
        place = Place(rng.uniform(0.03, 0.97) * cone.slant, rng.uniform(0.03, 0.97) * cone.wrap)
        squares.append(distance(cone, fit.place_map.apply(*reads(place)), place) ** 2)
    return math.sqrt(sum(squares) / len(squares))


@pytest.mark.long
def test_a_perfect_skin_is_mostly_left_alone() -> None:
    (sensor, _), rng = SENSORS, random.Random(2)
    fits = [fit_map(sensor, touched(sensor, lambda place: place, 9, 0.3e-3, seed)) for seed in range(20)]
    errors = [judged(sensor, fit, lambda place: place, rng) for fit in fits]
    assert math.sqrt(sum(e * e for e in errors) / 20) < 0.12e-3  # the marks alone would leave .25 mm
    assert all(fit.map_error > 0.05e-3 for fit in fits)  # so well do nine touches exclude that anything is wrong


@pytest.mark.long
def test_the_error_of_the_map_is_what_is_stated_for_places_that_nobody_touched() -> None:
    sensor, rng = SENSORS[0], random.Random(3)
    true = PlaceMap(sensor.frustum, *BENT)
    squares = said = 0.0
    for seed in range(24):
        fit = fit_map(sensor, touched(sensor, through(true), 16, 0.3e-3, seed))
        squares += judged(sensor, fit, through(true), rng) ** 2
        said += 2.0 * fit.map_error**2  # along and around
    assert 0.8 < math.sqrt(said / squares) < 1.4  # that nothing else is wrong with the sheet, 16 touches do not show


@pytest.mark.long
def test_a_film_is_read_within_half_a_millimetre_and_that_is_what_is_stated() -> None:
    sensor, rng = SENSORS[0], random.Random(4)
    tall, wide = sensor.frustum.slant, sensor.frustum.wrap
    squares, said = [], 0.0
    for seed in range(20):
        bends = [(rng.gauss(0.0, 0.5 * FILM_SHEETS.slope), *rng.choices((-1, 0, 1), k=2)) for _ in "uv"]

        def bent(x: float, y: float, bend: float, across: int, waves: int) -> float:  # 0 at both electrodes
            patch = 0.002 * waves * math.sin(math.tau * x) * math.cos(math.pi * y)
            return x + bend * x * (1.0 - x) + patch + 0.002 * across * math.sin(math.pi * x) * (2.0 * y - 1.0)

        def reads(place: Place, bends: list[tuple[float, int, int]] = bends) -> Place:
            x, y = place.u / tall, place.phi / wide
            return Place(tall * bent(x, y, *bends[0]), wide * bent(y, x, *bends[1]))

        fit = fit_map(sensor, touched(sensor, reads, 9, 0.3e-3, seed))
        squares.append(judged(sensor, fit, reads, rng) ** 2)
        said += 2.0 * fit.map_error**2
    assert math.sqrt(sum(squares) / 20) < 0.5e-3
    assert 0.8 < math.sqrt(said / sum(squares)) < 1.25


def test_the_next_mark_is_where_the_map_is_known_least() -> None:
    sensor = SENSORS[0]
    true = PlaceMap(sensor.frustum, *BENT)
    touches = [t for t in touched(sensor, through(true), 16, 0.3e-3) if t.mark.u < 0.8 * sensor.frustum.slant]
    fit = fit_map(sensor, touches)
    assert fit.next_mark.u > 0.8 * sensor.frustum.slant
    assert not fit.enough
    assert fit_map(sensor, touched(sensor, through(AFFINE), 16, 0.3e-3)).enough


@pytest.mark.parametrize("wrong", range(4))
@pytest.mark.long
def test_of_four_touches_none_may_be_15_mm_beside_its_mark(wrong: int) -> None:
    sensor = SENSORS[0]
    touches = touched(sensor, lambda place: place, 4, 0.3e-3)
    fit_map(sensor, touches)
    mark, read = touches[wrong]
    touches[wrong] = KnownTouch(mark, read._replace(phi=read.phi + 0.015 / sensor.frustum.radius_at(read.u)))
    with pytest.raises(SkinError, match="its touches contradict each other"):
        fit_map(sensor, touches)


@pytest.mark.parametrize(("count", "step"), [(9, 1), (16, 3)])
@pytest.mark.long
def test_a_touch_beside_its_mark_is_left_out_and_named(count: int, step: int) -> None:
    sensor = SENSORS[0]
    true = PlaceMap(sensor.frustum, (0.004, -0.012, *[0.0] * 4), (-0.006, 0.02, *[0.0] * 4))
    for seed in range(0, count, step):
        touches = touched(sensor, through(true), count, 0.3e-3, seed)
        wrong = touches[seed]
        touches[seed] = wrong._replace(read=Place(wrong.read.u + 0.008, wrong.read.phi - 0.2))
        fit = fit_map(sensor, touches)
        assert not fit.used[seed]
        assert distance(sensor.frustum, fit.place_map.apply(*true.invert(0.1, 2.0)), (0.1, 2.0)) < 0.6e-3


def test_leads_come_out_in_ohm() -> None:
    sensor = SENSORS[0]
    ohms, at_a, at_b = sensor.radial_ohms, 4.0, 11.0

    def reads(place: Place) -> Place:
        far = 1.0 - sensor.fractions(*place)[0]
        return Place(sensor.place(1.0 - (far * ohms + at_b) / (ohms + at_a + at_b), 0.5)[0], place.phi)

    fit = fit_map(sensor, touched(sensor, reads), PRECISE)
    assert fit.extra_ohms == pytest.approx((at_a, at_b, 0.0, 0.0), abs=0.05)


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: str(wrong[:3]))
@pytest.mark.parametrize("count", [4, 9, 16])
def test_exchanged_wires_are_refused_and_named(wrong, count: int) -> None:  # type: ignore[no-untyped-def]
    sensor = SENSORS[0]
    with pytest.raises(SkinError) as refused:
        fit_map(sensor, touched(sensor, lambda place: misread(sensor, wrong, place), count))
    assert wrong.cause in str(refused.value)


@pytest.mark.parametrize(
    ("along", "around", "words"),
    [
        (1.07, 1.0, "distances along 6.5 % too long"),
        (0.93, 1.0, "distances along 7.5 % too short"),
        (1.0, 1.06, "distances around 5.7 % too long"),
        (1.0, 0.94, "distances around 6.4 % too short"),
    ],
)
def test_gains_of_another_sheet_are_refused(along: float, around: float, words: str) -> None:
    sensor = SENSORS[0]
    middle = Place(0.5 * sensor.frustum.slant, 0.5 * sensor.frustum.wrap)

    def reads(place: Place) -> Place:
        x, y = sensor.fractions(*place)
        mid = sensor.fractions(*middle)
        return Place(*sensor.place(mid[0] + along * (x - mid[0]), mid[1] + around * (y - mid[1])))

    with pytest.raises(SkinError, match=words) as refused:
        fit_map(sensor, touched(sensor, reads), sheet_ohms=(923.0, 1083.0))
    assert "would have 923 and 1083 ohm per square; the scene says 1000 and 1000" in str(refused.value)


def test_an_offset_of_a_turned_sheet_is_refused() -> None:
    sensor = SENSORS[0]
    with pytest.raises(SkinError, match="mm off around, and 11 mm are allowed"):
        fit_map(sensor, touched(sensor, lambda place: Place(place.u, place.phi + 0.5)))


@pytest.mark.parametrize("kept", [[0, 1, 2], [0, 0, 1, 2, 2], [0, 1, 2, 2]])
def test_too_few_places_are_refused(kept: list[int]) -> None:
    touches = touched(SENSORS[0], lambda place: place)
    with pytest.raises(SkinError, match="needs touches at 4 places or more"):
        fit_map(SENSORS[0], [touches[k] for k in kept])


def test_marks_of_one_row_are_refused() -> None:
    touches = [touch for touch in touched(SENSORS[0], lambda place: place, 16) if touch.mark.u < 0.05]
    with pytest.raises(SkinError, match="30 % of the sheet apart along and around"):
        fit_map(SENSORS[0], touches)
