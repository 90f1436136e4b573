"""The fit of a place map: what it recovers, what it leaves alone, what it leaves out, and what it refuses."""

import math
import random
from collections.abc import Callable

import pytest

from coneskin.commissioning.calibration.calibrate import MARK_COUNTS, calibration_marks
from coneskin.commissioning.calibration.fit import KnownTouch, fit_map
from coneskin.commissioning.misreadings import WRONG, Place, misread
from coneskin.core.errors import SkinError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.calibration import PlaceMap
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor

FOREARM = Frustum(0.0376, 0.0372, 0.26, math.radians(350.0))
PAPER = Frustum(0.025, 0.05, 0.0968, 6.0)  # its radii double, as those of the paper's sector
SENSORS = [Sensor(FOREARM), Sensor(PAPER, polarity=Polarity("A", "D"))]
AFFINE = PlaceMap(FOREARM, (0.004, -0.012, 0.0, 0.0, 0.0), (-0.006, 0.02, 0.0, 0.0, 0.0))
BENT = ((0.004, -0.012, 0.03, 0.08, -0.06), (-0.006, 0.02, -0.05, 0.04, 0.07))


def touched(
    sensor: Sensor, reads: Callable[[Place], Place], count: int = 9, sigma: float = 0.0, seed: int = 0
) -> list[KnownTouch]:
    """Touches of all marks, each placed with an error, and read in some way."""
    rng = random.Random(seed)
    cone = sensor.frustum
    found = []
    for mark in calibration_marks(sensor, count):
        true = Place(mark.u + rng.gauss(0.0, sigma), mark.phi + rng.gauss(0.0, sigma) / cone.radius_at(mark.u))
        found.append(KnownTouch(mark.place, reads(true)))
    return found


def through(place_map: PlaceMap) -> Callable[[Place], Place]:
    """The reading that a map takes back."""
    return lambda place: Place(*place_map.invert(*place))


def distance(cone: Frustum, place: tuple[float, float], other: tuple[float, float]) -> float:
    return math.hypot(place[0] - other[0], cone.radius_at(other[0]) * math.remainder(place[1] - other[1], math.tau))


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("count", MARK_COUNTS)
def test_offset_and_gain_are_recovered_exactly(sensor: Sensor, count: int) -> None:
    true = PlaceMap(sensor.frustum, AFFINE.along, AFFINE.around)
    fit = fit_map(sensor, touched(sensor, through(true), count))
    assert (fit.along, fit.around) == ("offset and gain", "offset and gain")
    assert fit.place_map.along == pytest.approx(true.along, abs=1e-12)
    assert fit.place_map.around == pytest.approx(true.around, abs=1e-12)
    assert fit.before.rms > 1e-3
    assert fit.after.largest < 1e-12
    assert all(fit.used)


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_bend_is_recovered_where_there_are_enough_touches(sensor: Sensor) -> None:
    true = PlaceMap(sensor.frustum, *BENT)
    fit = fit_map(sensor, touched(sensor, through(true), 16))
    assert (fit.along, fit.around) == ("offset, gain and bend", "offset, gain and bend")
    assert fit.place_map.along == pytest.approx(true.along, abs=1e-12)
    assert fit.place_map.around == pytest.approx(true.around, abs=1e-12)
    assert fit_map(sensor, touched(sensor, through(true), 4)).along != "offset, gain and bend"


def test_a_perfect_skin_is_mostly_left_alone() -> None:
    (sensor, _), left_alone = SENSORS, 0
    for seed in range(20):
        fit = fit_map(sensor, touched(sensor, lambda place: place, 9, 0.3e-3, seed))
        left_alone += (fit.along == "nothing") + (fit.around == "nothing")
        assert fit.after.rms <= fit.before.rms
        worst = max(
            distance(sensor.frustum, fit.place_map.apply(u, phi), (u, phi))
            for u in (0.02, 0.13, 0.24)
            for phi in (0.3, 3.0, 5.8)
        )
        assert fit.map_error > 0.15e-3  # also where nothing was fitted: so well do nine touches exclude it
        assert worst < 1.2e-3  # four times the error with which the marks were placed
    assert left_alone >= 36


def test_the_error_of_the_map_is_what_is_stated() -> None:
    sensor = SENSORS[0]
    true = PlaceMap(sensor.frustum, AFFINE.along, AFFINE.around)
    squares, stated, corner = [], [], (0.0, 0.0)
    for seed in range(36):
        fit = fit_map(sensor, touched(sensor, through(true), 9, 0.3e-3, seed), 0.1e-3)
        if fit.along == fit.around == "offset and gain":
            read = true.invert(*corner)
            moved = [axis.apply(0.02, 0.3) for axis in (fit.place_map, true)]  # inside, where nothing is held at a rim
            assert distance(sensor.frustum, moved[0], moved[1]) < 1e-3
            gains = [fit.place_map.along[k] - true.along[k] for k in (0, 1)]
            turns = [fit.place_map.around[k] - true.around[k] for k in (0, 1)]
            along = (gains[0] - 0.5 * gains[1]) * sensor.frustum.slant
            around = (turns[0] - 0.5 * turns[1]) * sensor.frustum.wrap * sensor.frustum.radius1
            squares.append(along**2 + around**2)
            stated.append(fit.map_error**2)
            assert read != corner
    assert len(squares) > 30
    assert sum(squares) / sum(stated) == pytest.approx(1.0, abs=0.4)  # two numbers a try: a deviation of 17 %


@pytest.mark.parametrize("count", [9, 16])
def test_a_touch_beside_its_mark_is_left_out_and_named(count: int) -> None:
    sensor = SENSORS[0]
    true = PlaceMap(sensor.frustum, AFFINE.along, AFFINE.around)
    for seed in range(count):
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

    fit = fit_map(sensor, touched(sensor, reads))
    assert fit.extra_ohms == pytest.approx((at_a, at_b, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: str(wrong[:3]))
@pytest.mark.parametrize("count", MARK_COUNTS)
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
