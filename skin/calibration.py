"""Calibration of one sensor: the place map that takes off what places read wrongly, and the table of known forces.

A place is two fractions: x of the potential between the electrodes of the upper sheet, counted from end 1 (eq. 19), and
y of the wrap. Leads and joints that nobody knows, and electrodes off their drawing, give each an offset and a gain, a
sheet that lies askew a shear; sheets that are not uniform bend them smoothly. So with c = x - 1/2 and d = y - 1/2

    x' = x + a0 + a1 c + a2 d + a3 c d + a4 (c^2 - 1/12) + a5 (d^2 - 1/12)
    y' = y + b0 + b1 d + b2 c + b3 c d + b4 (c^2 - 1/12) + b5 (d^2 - 1/12)

The limits of the numbers keep the symmetric part of the Jacobian positive definite on the whole sheet, so the map is
one to one there. Its terms are orthogonal over the sheet.

The level hangs on the conductance c = level/(1 - level) of the contact, and that on the force by a power or so; between
the known forces the table is straight in their logarithms. Beyond them it says nothing: a firmer press hardly raises
the level any more, and a lighter one may not close the layers at all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum

from .sheet_functions import LogScale

#: largest magnitude of each number of a fraction; an offset or a gain beyond it is another sheet, or another wiring.
#: What bends by the square of the own fraction is .06 in coated sheets, as a standard deviation
MAP_LIMITS = (0.05, 0.05, 0.05, 0.15, 0.25, 0.25)
_SQUARE_MEAN = 1.0 / 12.0
_FULL_TURN = 2.0 * math.pi  # rad
_MAX_ITERATIONS = 120  # of the inverse; each leaves at most .75 of the error
_INVERSE_TOLERANCE = 1e-15
_log1p, _expm1 = math.log1p, math.expm1


def map_terms(x: float, y: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the terms that the numbers of a map belong to at the fractions x and y: those of x', then those of y'."""
    c, d = x - 0.5, y - 0.5
    bends = c * d, c * c - _SQUARE_MEAN, d * d - _SQUARE_MEAN
    return (1.0, c, d, *bends), (1.0, d, c, *bends)


@dataclass(frozen=True, slots=True)
class PlaceMap:
    """Correction of the places that a sensor reads.

    Attributes:
        frustum: of the sensor.
        along: a0 to a5: offset, gain (around the middle, beyond 1), shear, and three terms that bend, of the fraction
            along.
        around: b0 to b5, of the fraction around: the same.
        note: where it comes from, for people.

    Raises:
        SensorError: there are not 6 numbers, one is beyond its limit in ``MAP_LIMITS``, or an end is an apex.
    """

    frustum: Frustum
    along: tuple[float, ...] = (0.0,) * 6
    around: tuple[float, ...] = (0.0,) * 6
    note: str = field(default="", compare=False)
    _scale: LogScale = field(init=False, repr=False, compare=False)
    _live: tuple[float, ...] = field(init=False, repr=False, compare=False)  # what ``apply`` needs, to be had at once

    def __post_init__(self) -> None:
        cone = self.frustum
        if not min(cone.radius1, cone.radius2) > 0.0:
            raise SensorError(f"place_map.frustum must have no apex, which has no arc for an electrode; got {cone}")
        for name, values in (("along", self.along), ("around", self.around)):
            if len(values) != len(MAP_LIMITS) or not all(
                abs(value) <= most for value, most in zip(values, MAP_LIMITS, strict=True)
            ):
                raise SensorError(
                    f"place_map.{name} must be {len(MAP_LIMITS)} numbers of at most {', '.join(map(str, MAP_LIMITS))} "
                    f"in magnitude, or it is no correction of this sensor any more; got {values!r}"
                )
        (a0, *a), (b0, *b) = self.along, self.around
        growth = (cone.radius2 - cone.radius1) / (cone.radius1 * cone.slant)
        log_ratio = math.log1p(growth * cone.slant)
        live = (growth, log_ratio, cone.slant, cone.wrap, a0 - _SQUARE_MEAN * (a[3] + a[4]), *a)
        object.__setattr__(self, "_scale", LogScale(cone.radius1, cone.radius2, cone.slant))
        object.__setattr__(self, "_live", (*live, b0 - _SQUARE_MEAN * (b[3] + b[4]), *b))

    def apply(self, u: float, phi: float) -> tuple[float, float]:
        """Return where a touch is that is read at a place.

        Args:
            u: slant distance from end 1 that was decoded [m].
            phi: azimuth that was decoded [rad].

        Returns:
            u [m] and phi [rad], on the sheet: held at its ends and edges, or taken round where the wrap is a full turn.
        """
        growth, log_ratio, slant, wrap, a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, b5 = self._live
        c = (_log1p(growth * u) / log_ratio if growth else u / slant) - 0.5
        d = phi / wrap - 0.5
        step = a0 + a1 * c + d * (a2 + a3 * c + a5 * d) + a4 * c * c
        phi += wrap * (b0 + b1 * d + c * (b2 + b3 * d + b4 * c) + b5 * d * d)
        u += (1.0 + growth * u) / growth * _expm1(step * log_ratio) if growth else step * slant
        if not 0.0 <= u <= slant:
            u = 0.0 if u < 0.0 else slant
        if not 0.0 <= phi <= wrap:
            phi = phi % wrap if wrap == _FULL_TURN else 0.0 if phi < 0.0 else wrap
        return u, phi

    def jacobian(self, u: float, phi: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the derivatives of ``apply``, not held at the rims: ((du'/du, du'/dphi), (dphi'/du, dphi'/dphi)).

        The units are those of a change of u [m] and of phi [rad].
        """
        wrap, scale = self.frustum.wrap, self._scale
        x, y = scale.fraction(u), phi / wrap
        c, d = x - 0.5, y - 0.5
        (a0, a1, a2, a3, a4, a5), (_, b1, b2, b3, b4, b5) = self.along, self.around
        moved = x + a0 + a1 * c + a2 * d + a3 * c * d + a4 * (c * c - _SQUARE_MEAN) + a5 * (d * d - _SQUARE_MEAN)
        before = scale.slope(u)
        after = scale.slope(scale.distance(moved))
        return (
            ((1.0 + a1 + a3 * d + 2.0 * a4 * c) * before / after, (a2 + a3 * c + 2.0 * a5 * d) / (wrap * after)),
            ((b2 + b3 * d + 2.0 * b4 * c) * wrap * before, 1.0 + b1 + b3 * c + 2.0 * b5 * d),
        )

    def invert(self, u: float, phi: float) -> tuple[float, float]:
        """Return the place that is decoded where a touch is: inverse of ``apply``.

        Args:
            u: slant distance of the touch from end 1 [m].
            phi: its azimuth [rad].

        Returns:
            u [m] and phi [rad], which may be a few per cent beyond the rims.
        """
        wrap, scale = self.frustum.wrap, self._scale
        x0, y0 = scale.fraction(u), phi / wrap
        x, y = x0, y0
        for _ in range(_MAX_ITERATIONS):  # a contraction: rows of the correction's derivatives sum to at most .75
            for_x, for_y = map_terms(x, y)
            new_x = x0 - sum(a * term for a, term in zip(self.along, for_x, strict=True))
            new_y = y0 - sum(b * term for b, term in zip(self.around, for_y, strict=True))
            step = max(abs(new_x - x), abs(new_y - y))
            x, y = new_x, new_y
            if step < _INVERSE_TOLERANCE:
                break
        return scale.distance(x), wrap * y


@dataclass(frozen=True, slots=True)
class ForceTable:
    """Levels of known forces.

    Attributes:
        forces: rising [N].
        levels: that they give, rising too.
        error: standard deviation of a force that is read so, of the force itself, cross-validated over the places that
            were pressed.

    Raises:
        SensorError: there are fewer than two, they do not rise together, or a number is out of its range.
    """

    forces: tuple[float, ...]
    levels: tuple[float, ...]
    error: float

    def __post_init__(self) -> None:
        if len(self.forces) != len(self.levels) or len(self.forces) < 2:
            raise SensorError(f"forces must be two or more with a level each, got {self.forces!r} and {self.levels!r}")
        for name, values, most in (("forces", self.forces, math.inf), ("levels", self.levels, 1.0)):
            if not (all(0.0 < v < most for v in values) and all(a < b for a, b in pairwise(values))):
                raise SensorError(f"{name} must rise, above 0 and below {most:g}, got {values!r}")
        if not 0.0 <= self.error < 1.0:
            raise SensorError(f"error must be a part of the force from 0 to below 1, got {self.error!r}")

    def force(self, level: float) -> tuple[float, float] | None:
        """Return the force of a level and its standard deviation [N]; None beyond the known forces."""
        if not self.levels[0] <= level <= self.levels[-1]:
            return None
        value = _between(_strength(level), [_strength(x) for x in self.levels], self.forces)
        return value, self.error * value

    def level(self, force: float) -> float:
        """Return the level that a force [N] gives.

        Raises:
            SensorError: it is lighter or firmer than all that were tried.
        """
        low, high = self.forces[0], self.forces[-1]
        if not low <= force <= high:
            raise SensorError(
                f"a force must be one that the calibration knows, {low:g} to {high:g} N, got {force:g} N: "
                "calibrate with it"
            )
        strength = _between(force, self.forces, [_strength(x) for x in self.levels])
        return strength / (1.0 + strength)


def _strength(level: float) -> float:
    return level / (1.0 - level)


def _between(value: float, knots: Sequence[float], results: Sequence[float]) -> float:
    n = next(k for k in range(1, len(knots)) if value <= knots[k] or k == len(knots) - 1)
    share = math.log(value / knots[n - 1]) / math.log(knots[n] / knots[n - 1])
    return results[n - 1] * math.exp(share * math.log(results[n] / results[n - 1]))
