"""Padding of a skin: the compliant layer between what touches and the link, until it bottoms out.

The force is that of a spring, stiff from the thickness on, times a factor that grows with the speed of the indentation
(Hunt and Crossley), so that it begins and ends at 0 and never pulls:

    f = e(s) (1 + loss ds/dt),  e(s) = stiffness s up to the thickness, and hard_stiffness more per metre beyond

Source: Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42 (1975).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.core.errors import SensorError

__all__ = ["Padding"]


@dataclass(frozen=True, slots=True)
class Padding:
    """Padding of a skin as one thing that presses on it feels it. The defaults are assumed, not measured.

    Attributes:
        thickness: indentation at which it bottoms out [m].
        stiffness: until there [N/m].
        hard_stiffness: beyond, of what is below [N/m].
        loss: damping [s/m]; the force of an indentation at 1 m/s is 1 + loss times that at rest.

    Raises:
        SensorError: a value is not finite, or out of its range.
    """

    thickness: float = 6e-3
    stiffness: float = 10e3
    hard_stiffness: float = 1e6
    loss: float = 0.3

    def __post_init__(self) -> None:
        for name, unit in (("thickness", "m"), ("stiffness", "N/m"), ("hard_stiffness", "N/m")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SensorError(f"padding.{name} must be finite and above 0 {unit}, got {value!r} {unit}")
        if not (math.isfinite(self.loss) and self.loss >= 0.0):
            raise SensorError(f"padding.loss must be finite and not negative [s/m], got {self.loss!r}")

    def elastic(self, depth: float) -> float:
        """Return the force of an indentation at rest [N]; 0 without one."""
        if depth <= 0.0:
            return 0.0
        beyond = max(0.0, depth - self.thickness)
        return self.stiffness * (depth - beyond) + self.hard_stiffness * beyond

    def force(self, depth: float, rate: float) -> float:
        """Return the force of an indentation [m] that grows at a rate [m/s], in N; never below 0."""
        return max(0.0, self.elastic(depth) * (1.0 + self.loss * rate))

    def energy(self, depth: float) -> float:
        """Return the energy stored in an indentation [J]."""
        if depth <= 0.0:
            return 0.0
        soft, beyond = min(depth, self.thickness), max(0.0, depth - self.thickness)
        return 0.5 * self.stiffness * soft**2 + beyond * (self.stiffness * soft + 0.5 * self.hard_stiffness * beyond)
