"""Robin function of a sheet at one place, in plain floats for the live path.

What a contact feels of the sheet's edges (docs/understand/field.md): its value changes the spreading resistance, its
gradient displaces the electrical centre of an extended contact. `skin/field/robin` has the gradient for arrays, from
the same series.
"""

from __future__ import annotations

import cmath
import math

__all__ = ["RobinFunction"]

_DIGITS = 9.0  # natural logarithm of the precision at which the series in exp(-Sigma) ends


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
        count = next(n for n in range(16) if (2 * n + 1) * self._sigma > _DIGITS)
        self._powers = tuple(math.exp(-2.0 * n * self._sigma) for n in range(1, count + 1))
        self._inner = math.log(self._scale) + 2.0 * sum(math.log1p(-power) for power in self._powers)

    def gradient(self, x: float, y: float) -> tuple[float, float]:
        """Return its gradient [ohm/m] at a place of the rectangle [m], inside of it."""
        s, p, flip_s, flip_p = self._quarter(x, y)
        across, along = self._across, self._along
        corner = self._slope(cmath.exp(complex(-2.0 * s, -2.0 * p)))
        d_s = (across + along) * corner.real - 2.0 * along * s / self._sigma
        d_p = -(across + along) * corner.imag
        if across != along:
            d_s -= (across - along) * self._slope(complex(math.exp(-2.0 * s))).real
            d_p -= (across - along) * self._slope(cmath.exp(-2j * p)).imag
        d_s, d_p = self._scale * (-d_s if flip_s else d_s), self._scale * (-d_p if flip_p else d_p)
        return (d_s, d_p) if self._along_x else (d_p, d_s)

    def value_and_gradient(self, x: float, y: float) -> tuple[float, float, float]:
        """Return the function itself [ohm], distances measured in metres, and its gradient [ohm/m] along x and y."""
        s, p, flip_s, flip_p = self._quarter(x, y)
        across, along = self._across, self._along
        corner, slope = self._logarithm(cmath.exp(complex(-2.0 * s, -2.0 * p)))
        both, far = across + along, 2.0 * along * s / self._sigma
        total = both * (corner - self._inner) - far * s
        d_s, d_p = both * slope.real - far, -both * slope.imag
        if across != along:
            (end, slope_s), (edge, slope_p) = (
                self._logarithm(complex(math.exp(-2.0 * s))),
                self._logarithm(cmath.exp(-2j * p)),
            )
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

    def _slope(self, inverse: complex) -> complex:
        """d ln theta(z)/dz at exp(-z)."""
        total = 0.5 * (1.0 + inverse) / (1.0 - inverse)
        for power in self._powers:
            low, high = power * inverse, power / inverse
            total += low / (1.0 - low) - high / (1.0 - high)
        return total

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
