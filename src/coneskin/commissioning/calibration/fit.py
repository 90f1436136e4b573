"""Fit of a place map to touches of known places: robust, and no richer than the touches support.

For each of the two fractions: offset and gain (unknown leads and joints, electrodes off their drawing) and shear (a
sheet that is mounted askew), each with a normal prior about 0, and what sheets of a class read wrongly from place to
place, a Gaussian process whose variances are those of ``skin.tolerance``. How wide the priors are, which class it is,
and how much beside the marks' own error is left unexplained, is not known: all of a grid are fitted, and each weighs as
much as it makes the touches likely (Bayesian model averaging). What is not there is left alone. The map is what comes
nearest to their mean all over the sheet, and its error at places that nobody has touched is what is left there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coneskin.commissioning.misreadings import RIGHT, Place, explain, misfit
from coneskin.core.arrays import Floats
from coneskin.core.errors import SkinError
from coneskin.skin.calibration import MAP_LIMITS, PlaceMap, map_terms
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import LINE_SHARE, PATCH_SHARE, SHEET_CLASSES, SheetTolerance

MIN_TOUCHES = 4  #: at different places
_MIN_EXTENT = 0.3  # of the sheet, between the outermost of them


class KnownTouch(NamedTuple):
    """Touch of a known place."""

    mark: Place  #: where it was
    read: Place  #: what the sensor decoded there, without a place map


def _check_touches(sensor: Sensor, touches: Sequence[KnownTouch]) -> None:
    """Refuse touches that nothing can be fitted to, and those that a wiring or a mounting explains."""
    places = sorted({touch.mark for touch in touches})
    along, around = [mark.u for mark in places], [mark.phi for mark in places]
    wide = (
        (max(values) - min(values) >= _MIN_EXTENT * size)
        for values, size in ((along, sensor.frustum.slant), (around, sensor.frustum.wrap))
    )
    if len(places) < MIN_TOUCHES or not all(wide):
        got = ", ".join(f"{1e3 * mark.u:.0f} mm, {math.degrees(mark.phi):.0f} deg" for mark in places)
        raise SkinError(
            f"{sensor.name}: a calibration needs touches at {MIN_TOUCHES} places or more, the outermost of them "
            f"{100 * _MIN_EXTENT:.0f} % of the sheet apart along and around; got {len(places)}: {got or 'none'}"
        )
    marks, read = [touch.mark for touch in touches], [touch.read for touch in touches]
    if misfit(sensor, RIGHT, marks, read).rest > 1.0:
        cause = explain(sensor, marks, read)
        if cause.startswith("it reads as if"):
            raise SkinError(f"{sensor.name} cannot be calibrated: {cause}; mend that, and begin again")


def _check_offsets_and_gains(
    sensor: Sensor, along: Sequence[float], around: Sequence[float], sheet_ohms: tuple[float, float] | None
) -> None:
    """Refuse offsets and gains, along and around, that are no small error of this sheet, with the likely mistake."""
    cone = sensor.frustum
    sizes = cone.slant, cone.wrap * cone.radius_at(0.5 * cone.slant)
    hint = ""
    if sheet_ohms is not None:
        hint = (
            f" As large as the scene says, its untouched sheets would have {sheet_ohms[0]:.0f} and {sheet_ohms[1]:.0f} "
            f"ohm per square; the scene says {sensor.upper_sheet_ohms:g} and {sensor.lower_sheet_ohms:g}"
        )
    for word, key, (offset, gain), size in zip(
        ("along", "around"), ("height_mm", "wrap_deg"), (along, around), sizes, strict=True
    ):
        if abs(gain) > MAP_LIMITS[1]:
            said = "short" if gain > 0.0 else "long"
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it reads distances {word} {100.0 * abs(gain):.1f} % too {said}, "
                f"and {100.0 * MAP_LIMITS[1]:g} % are allowed. Is it another sheet than the scene says ({key}), were "
                "the marks measured from another edge than that of the active area, or has an electrode come off in "
                f"part?{hint}"
            )
        if abs(offset) > MAP_LIMITS[0]:
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it reads all places {1e3 * abs(offset) * size:.0f} mm off "
                f"{word}, and {1e3 * MAP_LIMITS[0] * size:.0f} mm are allowed. Were the marks measured from another "
                f"edge than that of the active area, or is the sheet turned or shifted on its link (xyz_mm, "
                f"rpy_deg)?{hint}"
            )


def _check_bends(sensor: Sensor, along: Sequence[float], around: Sequence[float]) -> None:
    """Refuse a map that bends places by more than any sheet of some quality does."""
    for word, numbers in (("along", along), ("around", around)):
        if any(abs(value) > most for value, most in zip(numbers, MAP_LIMITS, strict=True)):
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it bends places {word} by more than a calibration takes off "
                f"({', '.join(f'{value:+.3f}' for value in numbers)}): is the sheet torn, or far from uniform?"
            )


_AFFINE_TERMS = 3
_AFFINE_WIDTHS = (0.0, 0.003, 0.03)  # of a fraction; standard deviations of offset and gain, and of shear
_ERROR_BEND_CAUSES = (
    *((name, 0.0) for name in SHEET_CLASSES),
    *(("ideal", width) for width in (0.005, 0.02, 0.06)),
)  # of bends: a class of sheets, or any with a standard deviation of the terms that bend
_PATCH_WAVES = math.pi * np.arange(1.0, 5.0)[:, None, None]  # of what patches do, along their field
_PATCH_BREADTH = 0.3  # of the other side; distance over which it is alike
_SKEW_WAVES = math.pi * np.array([1.0, 3.0])[:, None, None]
_REST_RATIOS = (1.0, 1.3, 2.0, 4.0, 8.0)  # standard deviation of a touch over the marks' own error
_SIMPLER_ODDS = 3.0  # that a group of terms, or anything beside them, is not there, before any touch
_ENOUGH_SHARE = 0.9  # of the map's error; another mark that leaves more of it is not worth its touch
_MOST_CLAIMED = 2.0  # cross-validated error over what the map and the marks leave; 1.8 at most of 240 drawn skins
_MIN_ROBUST = 6  # touches; among fewer none can be called wrong
_MAX_WRONG = 0.25  # part of the touches that may be left out
_MAX_DEVIATIONS = 3.5  # by which a touch that is left out misses what most others say
_MEDIAN_TO_SIGMA = 1.4826  # of a normal distribution
_MIN_SPACING = 0.3  # of a fraction, between two touches that a first line is laid through
_GRID_PARTS = ((np.arange(11) + 0.5) / 11).tolist()  # of the sides, at which the error of the map is looked at


class Errors(NamedTuple):
    """Distances between touches and what is read there, along the surface [m]."""

    rms: float
    largest: float

    @classmethod
    def of(cls, along: Floats, around: Floats) -> Errors:
        """Return those of differences along and around [m]."""
        distance = np.hypot(along, around)
        return cls(float(np.sqrt(np.mean(distance**2))), float(distance.max()))


@dataclass(frozen=True, slots=True)
class CalibrationFit:
    """Result of a calibration's fit.

    Attributes:
        along: what was fitted along, in words.
        around: what was fitted around.
        used: of each touch, whether it was used; the others miss what most touches say.
        before: errors of the touches that were used, without a map.
        after: the same with maps fitted without the touch that is judged: cross-validated. Both hold the error with
            which the marks were placed and found, so that the map is better than this.
        left: of each touch, along and around, what a map fitted without it misses its mark by [m].
        map_error: standard deviation, along and around each, of the map at places that were not touched: root mean
            square over the sheet [m]. The error of the marks themselves is no part of it.
        next_mark: place whose touch would tell most.
        enough: another touch, there, would hardly make the map better.
        extra_ohms: of A, B, C and D: what the offsets and gains are if they are unknown leads and joints [ohm].
    """

    place_map: PlaceMap
    along: str
    around: str
    used: tuple[bool, ...]
    before: Errors
    after: Errors
    left: tuple[tuple[float, float], ...]
    map_error: float
    next_mark: Place
    enough: bool
    extra_ohms: tuple[float, float, float, float]


class _Axis(NamedTuple):
    """One fraction of all touches: what is missing to the mark, in parts; terms; metres for one part; places."""

    missing: Floats
    terms: Floats
    metres: Floats
    places: Floats  # this fraction and the other, a row each

    @property
    def missed(self) -> Floats:
        """What is missing to the mark [m]."""
        return self.missing * self.metres

    @property
    def design(self) -> Floats:
        """The terms [m]."""
        return self.terms * self.metres[:, None]

    def pick(self, chosen: NDArray[np.bool_]) -> _Axis:
        return _Axis(*(values[chosen] for values in self))

    def rest(self, numbers: Floats) -> Floats:
        """Return what these numbers leave [m]."""
        return (self.missing - self.terms @ numbers) * self.metres


def fit_map(
    sensor: Sensor,
    touches: Sequence[KnownTouch],
    mark_error: float = 0.3e-3,
    sheet_ohms: tuple[float, float] | None = None,
) -> CalibrationFit:
    """Fit a place map.

    Args:
        sensor: that was touched; its own place map plays no part.
        touches: at 4 different places or more.
        mark_error: standard deviation along and around with which marks were placed and found, at least [m].
        sheet_ohms: what its untouched sheets have per square, upper and lower, for the message of a refusal [ohm].

    Raises:
        SkinError: there are too few touches, or the sensor reads so wrongly that it is another sheet, is wired or
            mounted otherwise than it should be, or its touches contradict each other; the message says the cause.
    """
    _check_touches(sensor, touches)
    axes = _axes(sensor, touches)
    used = np.array(agreeing(sensor, touches, mark_error))
    inside = [axis.pick(used) for axis in axes]
    along, around = (_solve(axis, _AFFINE_TERMS).tolist()[:2] for axis in inside)
    _check_offsets_and_gains(sensor, along, around, sheet_ohms)
    grid = [Place(a * sensor.frustum.slant, b * sensor.frustum.wrap) for a in _GRID_PARTS for b in _GRID_PARTS]
    sheets = _axes(sensor, [KnownTouch(place, place) for place in grid])
    ohms = (sensor.radial_ohms, sensor.upper_sheet_ohms), (sensor.angular_ohms, sensor.lower_sheet_ohms)
    posteriors = [_average(*one, mark_error) for one in zip(inside, sheets, ohms, strict=True)]
    numbers = [posterior.numbers.tolist() for posterior in posteriors]
    _check_bends(sensor, *numbers)
    place_map = PlaceMap(sensor.frustum, tuple(numbers[0]), tuple(numbers[1]))
    left = [posterior.left for posterior in posteriors]
    map_error, next_mark, then = _untouched_error(grid, posteriors, mark_error)
    after = Errors.of(*left)
    claimed = math.sqrt(2.0 * (map_error**2 + mark_error**2))
    if after.rms > _MOST_CLAIMED * claimed:
        raise SkinError(
            f"{sensor.name} cannot be calibrated: its touches contradict each other. What the others say misses each "
            f"by {1e3 * after.rms:.1f} mm (rms), where {1e3 * claimed:.1f} mm are likely: was one beside its mark? "
            "Touch nine marks, of which a wrong one is found"
        )
    every = [axis.rest(posterior.numbers) for axis, posterior in zip(axes, posteriors, strict=True)]
    for whole, part in zip(every, left, strict=True):
        whole[used] = part
    return CalibrationFit(
        place_map,
        posteriors[0].words,
        posteriors[1].words,
        tuple(used.tolist()),
        Errors.of(inside[0].missed, inside[1].missed),
        after,
        tuple(zip(every[0].tolist(), every[1].tolist(), strict=True)),
        map_error,
        next_mark,
        then > _ENOUGH_SHARE * map_error,
        _extra_ohms(sensor, place_map),
    )


def _axes(sensor: Sensor, touches: Sequence[KnownTouch]) -> tuple[_Axis, _Axis]:
    cone, along, around = sensor.frustum, [], []
    for mark, read in touches:
        (x, y), (seen_x, seen_y) = _fractions(sensor, mark), _fractions(sensor, read)
        turned = y - seen_y
        if cone.wrap > math.pi:  # the nearer way, which may be across the seam
            turn = 2.0 * math.pi / cone.wrap
            turned -= turn * round(turned / turn)
        for_x, for_y = map_terms(seen_x, seen_y)
        along.append((x - seen_x, for_x, cone.slant / _slope(sensor, mark.u), (seen_x, seen_y)))
        around.append((turned, for_y, cone.wrap * cone.radius_at(mark.u), (seen_y, seen_x)))
    of_along, of_around = (_Axis(*map(np.array, zip(*rows, strict=True))) for rows in (along, around))
    return of_along, of_around


def _fractions(sensor: Sensor, place: Place) -> tuple[float, float]:
    """Return the fraction of the potential from end 1, and of the wrap."""
    radial, angular = sensor.fractions(*place)
    return 1.0 - radial if sensor.b_positive else radial, angular if sensor.c_positive else 1.0 - angular


def _slope(sensor: Sensor, u: float) -> float:
    """Return the change of the fraction along for the whole slant at the slope of a place."""
    return abs(sensor.radial_sensitivity(u)) / sensor.electronics.supply_volts * sensor.frustum.slant


def _solve(axis: _Axis, count: int) -> Floats:
    """Return the numbers that fit best in metres; those that are not fitted are zero."""
    numbers = np.zeros(len(MAP_LIMITS))
    numbers[:count] = np.linalg.lstsq(axis.design[:, :count], axis.missed, rcond=None)[0]
    return numbers


class _Posterior(NamedTuple):
    """What the touches leave of one fraction."""

    numbers: Floats
    covariance: Floats  #: of what is missing all over the sheet [m^2]
    unmapped: Floats  #: its mean beside the map [m]
    rest: float  #: variance of a touch beside the marks' own [m^2]
    left: Floats  #: what a map without each touch misses its mark by [m]
    words: str


def _flaws(sheets: SheetTolerance, ohms: tuple[float, float], axis: _Axis) -> Floats:
    """Return the covariances of what sheets of a class read wrongly at places [m^2]."""
    x, y = axis.places.T[:, :, None]
    leads = (sheets.lead**2 + (LINE_SHARE * sheets.line) ** 2) / ohms[0] ** 2
    sines = np.sin(_PATCH_WAVES * x) / _PATCH_WAVES
    patches = 2.0 * PATCH_SHARE * sheets.patches**2 * np.exp(-0.5 * ((y - y.T) / _PATCH_BREADTH) ** 2)
    half = 0.5 * _SKEW_WAVES * ohms[1] / ohms[0]
    turned = np.sin(_SKEW_WAVES * x) * np.sinh(half * (2.0 * y - 1.0)) / np.cosh(half) / _SKEW_WAVES**2
    skew, slope = 4.0 * sheets.skew * turned.sum(axis=0), 0.5 * sheets.slope * x * (1.0 - x)
    lines = leads * ((1.0 - x) * (1.0 - x.T) + x * x.T) + slope * slope.T + skew * skew.T
    return np.asarray(
        (lines + patches * (sines * sines.swapaxes(1, 2)).sum(axis=0)) * axis.metres * axis.metres[:, None]
    )


def _average(axis: _Axis, sheet: _Axis, ohms: tuple[float, float], mark_error: float) -> _Posterior:
    """Fit all causes of bends and widths of the priors, and average by how likely each makes the touches.

    Axis is of the touches, sheet of places all over, ohms from electrode to electrode and per square.
    """
    missing, count, fits = axis.missed, len(axis.missing), []
    every = _Axis(*map(np.concatenate, zip(axis, sheet, strict=True)))
    for cause in _ERROR_BEND_CAUSES:
        name, bend = cause
        flaws = _flaws(SHEET_CLASSES[name], ohms, every)
        for affine, shear, ratio in product(_AFFINE_WIDTHS, _AFFINE_WIDTHS, _REST_RATIOS):
            spread = every.design * (affine, affine, shear, bend, bend, bend)
            prior = flaws + spread @ spread.T
            noise = (ratio * mark_error) ** 2
            inverse = np.linalg.inv(prior[:count, :count] + noise * np.eye(count))
            absent = (affine, shear, ratio - 1.0, _ERROR_BEND_CAUSES.index(cause)).count(0)
            odds = absent * math.log(_SIMPLER_ODDS) - 2.0 * math.log(ratio)
            odds += 0.5 * (np.linalg.slogdet(inverse)[1] - missing @ inverse @ missing)
            gain = prior[count:, :count] @ inverse
            alone = inverse @ missing / np.diag(inverse)  # what is missing to what the other touches say
            covariance = prior[count:, count:] - gain @ prior[:count, count:]
            fits.append((odds, gain, covariance, alone, noise - mark_error**2, cause != _ERROR_BEND_CAUSES[0]))
    evidence, gains, covariances, alones, rests, bent = (np.array(each) for each in zip(*fits, strict=True))
    weights = np.exp(evidence - evidence.max())
    weights /= weights.sum()
    gain = np.tensordot(weights, gains, 1)
    mean = gain @ missing
    off = gains @ missing - mean
    fitted = np.linalg.pinv(sheet.design)
    smoothed = axis.design @ fitted @ gain
    words = "offset, gain, shear and bend" if weights @ bent > 0.5 else "offset, gain and shear"
    return _Posterior(
        fitted @ mean,
        np.tensordot(weights, covariances, 1) + (off.T * weights) @ off,
        mean - sheet.design @ fitted @ mean,
        float(weights @ rests),
        missing - smoothed @ missing + np.diag(smoothed) * (weights @ alones),
        words,
    )


def _untouched_error(
    places: Sequence[Place], posteriors: Sequence[_Posterior], mark_error: float
) -> tuple[float, Place, float]:
    """Return the error of the map over the sheet [m], the place that a touch would tell most of, and the error then."""
    now, then = np.zeros(len(places)), np.zeros(len(places))
    for posterior in posteriors:
        own = np.diag(posterior.covariance)
        beside = float(np.mean(posterior.unmapped**2)) + posterior.rest
        now += own + beside
        then += np.mean(own) + beside
        then -= np.mean(posterior.covariance**2, axis=0) / (own + mark_error**2 + posterior.rest)
    best = int(np.argmin(then))
    return math.sqrt(0.5 * max(0.0, float(np.mean(now)))), places[best], math.sqrt(0.5 * max(0.0, float(then[best])))


def agreeing(sensor: Sensor, touches: Sequence[KnownTouch], mark_error: float) -> list[bool]:
    """Return which touches agree with what most say, by offset and gain; arguments as of ``fit_map``."""
    axes, count = _axes(sensor, touches), len(touches)
    if count < _MIN_ROBUST:
        return [True] * count
    rest = [np.abs(_least_median(axis)) for axis in axes]
    for _ in range(4):
        scales = [
            max(_MEDIAN_TO_SIGMA * (1.0 + 5.0 / (count - 2)) * float(np.median(part)), mark_error) for part in rest
        ]
        misses = np.maximum(*(part / scale for part, scale in zip(rest, scales, strict=True)))
        limit = max(_MAX_DEVIATIONS, float(np.sort(misses)[count - int(_MAX_WRONG * count) - 1]))
        used = misses <= limit
        rest = [np.abs(axis.rest(_solve(axis.pick(used), 2))) for axis in axes]
    return [bool(value) for value in used]


def _least_median(axis: _Axis) -> Floats:
    """Return what is missing [m] from the line through two touches that is nearest to most others (Rousseeuw 1984)."""
    at, best, least = axis.terms[:, 1], axis.missed, math.inf
    for i, j in combinations(range(len(at)), 2):
        if abs(at[i] - at[j]) >= _MIN_SPACING:
            gain = (axis.missing[j] - axis.missing[i]) / (at[j] - at[i])
            rest = (axis.missing - axis.missing[i] - gain * (at - at[i])) * axis.metres
            if (median := float(np.median(np.abs(rest)))) < least:
                best, least = rest, median
    return best


def _extra_ohms(sensor: Sensor, place_map: PlaceMap) -> tuple[float, float, float, float]:
    """Return what A, B, C and D have more in series than the scene says, if offset and gain are due to that.

    b ohm where a fraction x begins and a where it ends make (x R + b) / (R + a + b) of it, which the map takes back.
    """
    (offset1, gain1, *_), (offset2, gain2, *_) = place_map.along, place_map.around
    radial, angular = sensor.radial_ohms, sensor.angular_ohms
    return (
        radial * (0.5 * gain1 + offset1),
        radial * (0.5 * gain1 - offset1),
        angular * (0.5 * gain2 + offset2),
        angular * (0.5 * gain2 - offset2),
    )
