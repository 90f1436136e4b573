"""Points on the rims of discs that crowd where a rim comes near the apex, an edge or another disc.

Multipoles resolve every part of a rim alike, so a gap of 1e-4 radii asks for 1e4 of them. Here t runs evenly, and is
the mean of theta and of its images under maps of the disc to itself,
theta -> arg of (zeta - rho e^(i at)) / (1 - rho e^(-i at) zeta): each crowds its share of the points at `at` on the
scale 1 - rho. One map for every factor of 4 from the radius down to the gap resolves all scales; all is analytic, so
the error falls geometrically.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .circles import offsets_of, places_of
from .disc import Discs
from .green import Strip
from .sheet import SectorSheet

__all__ = ["RimPoints", "log_weights"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FACTOR = 4.0  # from one scale to the next
_SMALLEST = 1e-9  # scale, in radii; nearer than that a rim counts as touching


@dataclass(frozen=True, slots=True, eq=False)
class RimPoints:
    """N points on each rim of one scene of k discs; lengths in the rectangle in units of (shorter side)/pi.

    Attributes:
        t: equidistant from 0 to 2 pi, shape (N,).
        theta: polar angle on the disc [rad], shape (k, N).
        speed: dtheta/dt, shape (k, N).
        offset: x + i y of the points from their centres, shape (1, k, N).
        slope: |d offset / dt|, shape (1, k, N).
        s: centres from s = 0, shape (1, k).
        s_far: centres from s = Sigma, shape (1, k).
        p: centres from p = 0, shape (1, k).
        p_far: centres from p = pi, shape (1, k).
    """

    t: Floats
    theta: Floats
    speed: Floats
    offset: Complex
    slope: Floats
    s: Floats
    s_far: Floats
    p: Floats
    p_far: Floats

    @classmethod
    def of(cls, sheet: SectorSheet, strip: Strip, discs: Discs, density: int) -> RimPoints:
        """Make them for one scene, `density` (even) for each scale."""
        k = discs.u.shape[1]
        maps = [_maps(sheet, discs, i) for i in range(k)]
        n = density * (2 + max(len(m) for m in maps))
        t = 2.0 * math.pi * np.arange(n) / n
        theta, speed = (np.array(v) for v in zip(*(_crowd(t, m) for m in maps), strict=True))
        offset, slope = offsets_of(sheet, discs, np.exp(1j * theta)[None])
        s, s_far, p, p_far = places_of(sheet, strip, discs)
        return cls(t, theta, speed, offset * strip.scale, slope * strip.scale * speed, s, s_far, p, p_far)


def _maps(sheet: SectorSheet, discs: Discs, i: int) -> list[tuple[float, float]]:
    """Return (rho, at) of the maps that disc i needs."""
    u, phi, a = (float(v[0, i]) for v in (discs.u, discs.phi, discs.radius))
    kappa, h = sheet.curvature, float(sheet.stretch(u))
    near = [(u / a - 1.0, math.pi), ((sheet.width - u) / a - 1.0, 0.0)]
    if kappa != 0.0:
        near.append((h / (abs(kappa) * a) - 1.0, math.pi if kappa > 0.0 else 0.0))
    for y, side in ((sheet.arc * phi / sheet.wrap, -1.0), (sheet.arc * ((sheet.wrap - phi) / sheet.wrap), 1.0)):
        if abs(kappa * y) < 0.5 * math.pi:
            near.append((h * y * float(np.sinc(kappa * y / math.pi)) / a - 1.0, side * (0.5 * math.pi + kappa * y)))
    for j in range(discs.u.shape[1]):
        if j != i:
            to = complex(sheet.flat(discs.u[0, j], discs.phi[0, j], (u, phi)))
            near.append(((abs(to) - float(discs.radius[0, j])) / a - 1.0, math.atan2(to.imag, to.real)))
    out = []
    for gap, at in near:
        scale = 0.5
        while gap < 2.0 * scale and scale > _SMALLEST:
            out.append((1.0 - scale, at))
            scale /= _FACTOR
    return out


def _crowd(t: Floats, maps: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Return theta(t) and dtheta/dt: Newton's method, kept within a bracket."""
    share = 1.0 / (2 + len(maps))

    def forward(theta: Floats) -> tuple[Floats, Floats]:
        total, slope = 2.0 * share * theta, np.full_like(theta, 2.0 * share)
        for rho, at in maps:
            angle = np.remainder(theta - at + math.pi, 2.0 * math.pi) - math.pi
            image = 2.0 * np.arctan((1.0 + rho) / (1.0 - rho) * np.tan(0.5 * angle))
            total += share * (theta - angle + image)
            slope += share * (1.0 - rho**2) / ((1.0 - rho) ** 2 + 4.0 * rho * np.sin(0.5 * angle) ** 2)
        return total, slope

    low, high, theta = np.full_like(t, -3.0 * math.pi), np.full_like(t, 5.0 * math.pi), t.copy()
    for _ in range(100):
        got, slope = forward(theta)
        above = got > t
        high, low = np.where(above, np.minimum(high, theta), high), np.where(above, low, np.maximum(low, theta))
        new = theta - (got - t) / slope
        new = np.where((new <= low) | (new >= high), 0.5 * (low + high), new)
        moved = float(np.abs(new - theta).max())
        theta = new
        if moved < 1e-15:
            break
    return theta, 1.0 / forward(theta)[1]


def log_weights(n: int) -> Floats:
    """Return the weights of f at n points t' (even) in the integral of ln(4 sin^2((t - t')/2)) f(t') dt', shape (n, n).

    Kress, Linear integral equations, section 12.3: exact for trigonometric polynomials below n/2.
    """
    spectrum = np.zeros(n // 2 + 1)
    spectrum[1:] = -2.0 * math.pi / np.arange(1, n // 2 + 1)
    row = np.fft.irfft(spectrum, n)
    return np.asarray(row[(np.arange(n)[:, None] - np.arange(n)[None, :]) % n])
