"""Logarithmic scale of the radial field: potential against distance where the width of the sheet changes (eq. 19, 20).

The paper's potential is linear in ln r. r is proportional to the radius rho of the link, rho is linear in the distance
t along the side, and so the fraction f of the potential difference that has passed at t is

    f = ln(rho(t)/rho0) / L,        L = ln(rho1/rho0),        rho(t) = rho0 + t (rho1 - rho0)/s

and its inverse is t = s f E(f L)/E(L) with E(x) = expm1(x)/x. Written so, the cylinder (L = 0) is an ordinary value, r
never appears, and no two nearly equal radii are subtracted (eq. 20 as printed has lost every digit at L = 1e-15).
"""

from __future__ import annotations

import math

__all__ = ["LogScale"]

_log, _log1p, _expm1 = math.log, math.log1p, math.expm1


class LogScale:
    """The relation of potential and distance, measured from one end of the side.

    Args:
        near: radius at the end where distance and fraction are 0 [m], above 0.
        far: radius at the other end, where the fraction is 1 [m], above 0.
        length: distance between the ends along the side [m], above 0.

    Both directions hold a relative 1e-14 wherever the result is not ill-conditioned in the argument itself.
    """

    __slots__ = ("_growth", "_log_ratio", "_mean", "_moderate", "_ratio", "_stretch", "length", "near")

    def __init__(self, near: float, far: float, length: float) -> None:
        self.near = near
        self.length = length
        self._ratio = far / near
        self._growth = (far - near) / near
        # Within a factor of two far - near is exact, so log1p and expm1 lose nothing; beyond it they amplify the
        # rounding of the difference, and log and pow of the ratio itself do not.
        self._moderate = 0.5 <= self._ratio <= 2.0
        self._log_ratio = _log1p(self._growth) if self._moderate else _log(self._ratio)
        self._mean = self._growth / self._log_ratio if self._log_ratio else 1.0  # E(L)
        self._stretch = length / self._mean if self._moderate else length / self._growth

    @property
    def mean_radius(self) -> float:
        """Logarithmic mean of the two radii [m]: sheet resistance times length over wrap times this is a resistance."""
        return self.near * self._mean

    def distance(self, fraction: float) -> float:
        """Return the distance from the near end [m] where this fraction of the potential has passed (eq. 20)."""
        x = fraction * self._log_ratio
        if self._moderate:
            return fraction * self._stretch * (_expm1(x) / x if x else 1.0)
        if -0.5 < x < 0.5:
            return self._stretch * _expm1(x)
        return float(self._stretch * (self._ratio**fraction - 1.0))

    def fraction(self, distance: float) -> float:
        """Return the fraction of the potential difference that has passed at this distance [m] (eq. 19)."""
        part = distance / self.length
        x = part * self._growth
        if self._moderate:
            return part * self._mean * (_log1p(x) / x if x else 1.0)
        ratio = (self.length - distance) / self.length + part * self._ratio
        if 0.5 < ratio < 2.0:
            return _log1p(x) / self._log_ratio
        return _log(ratio) / self._log_ratio

    def radius(self, fraction: float) -> float:
        """Return the link's radius [m] where this fraction of the potential has passed: eq. 20 as printed."""
        return float(self.near * self._ratio**fraction)

    def slope(self, distance: float) -> float:
        """Return the derivative of the fraction by the distance [1/m], eq. 25 over U0 in terms of the distance."""
        s = self.length
        return self._mean / ((s - distance) + distance * self._ratio)
