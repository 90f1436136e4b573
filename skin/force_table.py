"""Table of forces of one sensor: what force its level stands for, as known forces have shown.

The level hangs on the conductance c = level/(1 - level) of the contact, and that on the force by a power or so; between
the known forces the table is straight in their logarithms. Beyond them it says nothing: a firmer press hardly raises
the level any more, and a lighter one may not close the layers at all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from coneskin.core.errors import SensorError

__all__ = ["ForceTable"]


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
        """Return the level that a force gives.

        Args:
            force: [N].

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
    """Interpolate between two logarithms."""
    n = next(k for k in range(1, len(knots)) if value <= knots[k] or k == len(knots) - 1)
    share = math.log(value / knots[n - 1]) / math.log(knots[n] / knots[n - 1])
    return results[n - 1] * math.exp(share * math.log(results[n] / results[n - 1]))
