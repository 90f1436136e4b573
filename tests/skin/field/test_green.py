"""The Green function against its eigenfunction series, and the Bessel ratios against 40 digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from coneskin.skin.field.circles import green_block, make_circles
from coneskin.skin.field.disc import Discs, bessel_ratios
from coneskin.skin.field.green import Strip

from ..field_cases import SHEETS


def one_line(k: float, s: float, t: float, length: float, ends: bool) -> float:
    """Green function of -d2/ds2 + k^2 on a line; zero (ends) or insulated at both."""
    low, high, sign = min(s, t), max(s, t), -1.0 if ends else 1.0
    images = (1 + sign * math.exp(-2 * k * low)) * (1 + sign * math.exp(-2 * k * (length - high)))
    return math.exp(-k * (high - low)) * images / (2 * k * (1 - math.exp(-2 * k * length)))


def series(z: complex, w: complex, length: float, breadth: float, upper: bool) -> float:
    """Green function of one sheet: sines across its electrodes, a line's Green function along them."""
    across, along = (length, breadth) if upper else (breadth, length)
    a, b, s, t = (z.real, w.real, z.imag, w.imag) if upper else (z.imag, w.imag, z.real, w.real)
    return sum(
        2 / across * math.sin(k * a) * math.sin(k * b) * one_line(k, s, t, along, False)
        for k in (n * math.pi / across for n in range(1, 4000))
    )


@pytest.mark.parametrize("name", list(SHEETS))
@pytest.mark.parametrize("lower", [1.0, 3.0])
def test_green_function_is_its_eigenfunction_series(name: str, lower: float) -> None:
    sheet = SHEETS[name]
    strip = Strip.of(sheet.length, sheet.breadth)
    a, b = (lower, 1.0) if strip.along_x else (1.0, lower)
    for first, second in (((0.3, 0.3), (0.7, 0.45)), ((0.8, 0.8), (0.6, 0.2)), ((0.2, 0.7), (0.3, 0.75))):
        u, phi = (np.array([[first[i], second[i]]]) * (sheet.width, sheet.wrap)[i] for i in (0, 1))
        tiny = np.full((1, 2), 1e-7 * min(sheet.width, sheet.breadth))
        circles = make_circles(sheet, strip, Discs(u, phi, tiny, tiny), 1, 4)
        z, w = (complex(float(sheet.along(u[0, i])[0]), float(sheet.across(phi[0, i])[0])) for i in (0, 1))
        exact = series(z, w, sheet.length, sheet.breadth, True) + lower * series(
            z, w, sheet.length, sheet.breadth, False
        )
        for i, j in ((0, 1), (1, 0)):
            value = green_block(strip, circles, i, j, a, b)[0][0, 0, 0]
            assert value == pytest.approx(exact, abs=2e-14)  # the mean over a circle is the value in its middle


@pytest.mark.parametrize("name", ["cylinder", "long strip"])
def test_a_disc_of_a_nanometre_loses_no_digit(name: str) -> None:
    """Its own logarithm is left out, which leaves (Ra + Rb)/(2 pi) ln(1/radius): nothing else depends on its size."""
    sheet, values = SHEETS[name], []
    strip = Strip.of(sheet.length, sheet.breadth)
    for radius in (1e-6, 1e-9):
        at = np.array([[0.3 * sheet.width]]), np.array([[0.4 * sheet.wrap]]), np.array([[radius]]), np.array([[1.0]])
        circles = make_circles(sheet, strip, Discs(*at), 1, 4)
        values.append(green_block(strip, circles, 0, 0, 1.0, 3.0)[0][0, 0, 0])
    assert values[1] - values[0] == pytest.approx(4.0 / (2.0 * math.pi) * math.log(1e3), abs=1e-13)


@pytest.mark.parametrize("x", [1e-12, 1e-3, 0.7, 3.0, 9.9, 40.0, 1e3, 1e6, 1e10, 1e150])
def test_bessel_ratios(x: float) -> None:
    got = bessel_ratios(np.array([x]), 130)[0]
    with mpmath.workdps(40):
        for m in (1, 2, 7, 40, 130):
            if x < 1e5:
                exact = mpmath.besseli(m, x) / mpmath.besseli(m - 1, x)
            else:  # -m/x + ... : the recurrence of Riccati, three terms
                exact = (
                    1 - mpmath.mpf(2 * m - 1) / (2 * x) + mpmath.mpf(4 * m * m - 8 * m + 3) / (8 * mpmath.mpf(x) ** 2)
                )
            # rounding of the last steps; the series' next term m^3/x^3 is below it
            assert got[m - 1] == pytest.approx(float(exact), rel=4e-15)


def test_bessel_ratios_at_the_ends() -> None:
    assert (bessel_ratios(np.array([0.0]), 5) == 0.0).all()
    assert (bessel_ratios(np.array([math.inf]), 5) == 1.0).all()
