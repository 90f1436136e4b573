"""Frusta of every kind, drawn by hypothesis, and their exact values by mpmath."""

import math

import mpmath as mp
from hypothesis import strategies as st

from coneskin.geometry.frustum import Frustum

mp.mp.dps = 60

radii = st.one_of(st.just(0.0), st.floats(1e-6, 10.0))
heights = st.one_of(st.just(0.0), st.floats(1e-9, 10.0))
wraps = st.one_of(st.just(2 * math.pi), st.floats(1e-3, 2 * math.pi))


@st.composite
def frusta(draw):
    """Cones of every kind: cylinders, near cylinders, discs, apexes, narrowing ones."""
    radius1 = draw(radii)
    kind = draw(st.sampled_from(["any", "cylinder", "near"]))
    if kind == "any":
        radius2 = draw(radii)
    else:
        radius1 = radius2 = radius1 or 0.05
        if kind == "near":
            radius2 *= 1.0 + draw(st.floats(-1e-6, 1e-6))
    height = draw(heights)
    if radius1 == radius2 == 0.0 or (height == 0.0 and radius1 == radius2):
        radius1, height = 0.05, 0.1
    return Frustum(radius1, radius2, height, draw(wraps))


fractions = st.floats(0.0, 1.0)
#: a handful of roundings of 1.1e-16 each, and the condition of sin and cos at angles up to 2 pi
RTOL = 1e-14
#: absolute part [m]: below 2.2e-308 a double is rounded to multiples of 4.9e-324, not to a share of itself, and
#: ``radius_at`` divides such a product by the slant, here 2e-22 m at least (one spacing of a radius of 1e-6 m):
#: 2.5e-302, times 2 pi of azimuth and a few such roundings. Only a point that close to an apex is so small.
UNDERFLOW = 1e-300


def exact(frustum):
    """s, sin a, cos a with 60 digits, from the frustum's own doubles."""
    rho1, rho2, h = (mp.mpf(x) for x in (frustum.radius1, frustum.radius2, frustum.height))
    s = mp.sqrt(h * h + (rho2 - rho1) ** 2)
    return rho1, rho2, h, s, (rho2 - rho1) / s, h / s


def close(got, want, scale=None):
    """Return whether a double agrees with an mpmath number to RTOL of the scale (default: of the number)."""
    return abs(mp.mpf(got) - want) <= RTOL * (abs(want) if scale is None else scale) + UNDERFLOW
