"""Functions of a sheet in plain floats, for the live path: the logarithmic scale along it, and the Robin function.

The paper's potential is linear in ln r. r is proportional to the radius rho of the link, rho is linear in the distance
t along the side, and so the fraction f of the potential difference that has passed at t is

    f = ln(rho(t)/rho0) / L,        L = ln(rho1/rho0),        rho(t) = rho0 + t (rho1 - rho0)/s

and its inverse is t = s f E(f L)/E(L) with E(x) = expm1(x)/x. Written so, the cylinder (L = 0) is an ordinary value, r
never appears, and no two nearly equal radii are subtracted (eq. 20 as printed has lost every digit at L = 1e-15).

The Robin function is what a point of contact feels of the sheet's edges (docs/understand/field.md): its value changes
the spreading resistance, its gradient displaces the electrical centre of an extended contact. It is the value at z' = z
of Ru G_u + Rl G_l without its logarithm. In the strip of `field/green`, with w = s + ip and q = exp(-Sigma),

    gamma = (1/2 pi) [ (Ra+Rb) ln|theta(2w)| - (Ra-Rb) ln|theta(2s)/theta(2ip)| ] - Rb s^2/(pi Sigma) + const
    theta(z) = 2 sinh(z/2) prod (1 - q^2n e^z)(1 - q^2n e^-z)

In the flat sheet the stretch adds (Ru+Rl)/(2 pi) ln(r/r1).
"""

from __future__ import annotations

import cmath
import math

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

    def slope(self, distance: float) -> float:
        """Return the derivative of the fraction by the distance [1/m], eq. 25 over U0 in terms of the distance."""
        s = self.length
        return self._mean / ((s - distance) + distance * self._ratio)


_LOG_PRECISION = 9.0  # natural logarithm of the precision at which the series in exp(-Sigma) ends


class RobinFunction:
    """Robin function in the rectangle that the sheet maps to, without the stretch.

    Args:
        length: of the rectangle between the arcs, along x [m].
        breadth: of the rectangle between the straight edges, along y [m].
        upper_ohms: sheet resistance of the layer whose electrodes are at the ends of x [ohm per square].
        lower_ohms: of the layer whose electrodes are at the ends of y.
    """

    __slots__ = ("_across", "_along", "_along_x", "_breadth", "_inner", "_length", "_powers", "_scale", "_sigma")

    def __init__(self, length: float, breadth: float, upper_ohms: float, lower_ohms: float) -> None:
        self._length, self._breadth = length, breadth
        self._along_x = breadth <= length
        short = min(length, breadth)
        self._scale = math.pi / short
        self._sigma = math.pi * max(length, breadth) / short
        across, along = (lower_ohms, upper_ohms) if self._along_x else (upper_ohms, lower_ohms)
        self._across, self._along = across / math.pi, along / math.pi
        count = next(n for n in range(16) if (2 * n + 1) * self._sigma > _LOG_PRECISION)
        self._powers = tuple(math.exp(-2.0 * n * self._sigma) for n in range(1, count + 1))
        self._inner = math.log(self._scale) + 2.0 * sum(math.log1p(-power) for power in self._powers)

    def value_and_gradient(self, x: float, y: float) -> tuple[float, float, float]:
        """Return the function [ohm], distances measured in metres, and its gradient [ohm/m], at a place inside [m]."""
        s, p, flip_s, flip_p = self._quarter(x, y)
        across, along = self._across, self._along
        corner, slope = self._logarithm(cmath.exp(complex(-2.0 * s, -2.0 * p)))
        both, far = across + along, 2.0 * along * s / self._sigma
        total = both * (corner - self._inner) - far * s
        d_s, d_p = both * slope.real - far, -both * slope.imag
        if across != along:
            end, slope_s = self._logarithm(complex(math.exp(-2.0 * s)))
            edge, slope_p = self._logarithm(cmath.exp(-2j * p))
            differ = across - along
            total -= differ * (end - edge)
            d_s -= differ * slope_s.real
            d_p -= differ * slope_p.imag
        d_s, d_p = self._scale * (-d_s if flip_s else d_s), self._scale * (-d_p if flip_p else d_p)
        return (0.5 * total, d_s, d_p) if self._along_x else (0.5 * total, d_p, d_s)

    def _quarter(self, x: float, y: float) -> tuple[float, float, bool, bool]:
        """Return the place measured from the nearest corner, in units of the shorter side over pi."""
        s, p, s_side, p_side = (
            (x, y, self._length, self._breadth) if self._along_x else (y, x, self._breadth, self._length)
        )
        flip_s, flip_p = s > 0.5 * s_side, p > 0.5 * p_side
        return self._scale * (s_side - s if flip_s else s), self._scale * (p_side - p if flip_p else p), flip_s, flip_p

    def _logarithm(self, inverse: complex) -> tuple[float, complex]:
        """ln |theta(z)| at exp(-z), and the slope of ln theta."""
        rest = 1.0 - inverse
        slope, product = 0.5 * (1.0 + inverse) / rest, rest * rest / inverse
        for power in self._powers:
            low, high = power * inverse, power / inverse
            rest_low, rest_high = 1.0 - low, 1.0 - high
            slope += low / rest_low - high / rest_high
            rest = rest_low * rest_high
            product *= rest * rest
        return 0.5 * math.log(abs(product)), slope
