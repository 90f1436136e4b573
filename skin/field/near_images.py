"""Image of a disc in a near edge, and another disc beside it, with exact Fourier coefficients.

Between unequal sheets each edge of the sector mirrors a disc with the strength (Ru - Rl). In the flat sheet a
straight edge mirrors by reflection, an arc by inversion, so from point zeta of the circle to the image of zeta' the
distance is, to a constant, |1 + alpha zeta + alpha* zeta'* + gamma zeta zeta'*|. Its logarithm has the coefficients

    L_m0 = -(-alpha)^m / m,     L_mn = -sum_k delta^k/k C(m-1,k-1) C(n-1,k-1) (-alpha)^(m-k) (-alpha*)^(n-k)

of zeta^m zeta'*^n, with delta = |alpha|^2 - gamma: sums of one sign. Taken out of the sampled Green function and
put back as coefficients, the nearest singularity no longer decides how many points a circle needs. From disc to disc
the distance is |1 + alpha zeta + beta zeta'|: the same with zeta' for zeta'* and gamma = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .disc import Discs
from .sheet import SectorSheet

__all__ = [
    "EdgeImage",
    "edge_images",
    "image_coefficients",
    "image_distance",
    "other_disc",
    "pair_coefficients",
    "pair_distance",
]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NEAR_ALPHA = 0.25  # |alpha| of an edge that counts as near: two radii between centre and edge


@dataclass(frozen=True, slots=True, eq=False)
class EdgeImage:
    """One edge as each of n discs sees it.

    Attributes:
        arc: the edge is an arc (A or B), otherwise straight (C or D).
        alpha: at most 1/2 in modulus where the edge is straight; 0 where it is far, shape (n,).
        gamma: shape (n,).
        delta: shape (n,).
    """

    arc: bool
    alpha: Complex
    gamma: Floats
    delta: Floats


def edge_images(sheet: SectorSheet, discs: Discs, place: int) -> list[EdgeImage]:
    """Find the near edges of the discs at one place of every scene; edges that no disc is near are left out."""
    u, phi, a = discs.u[:, place], discs.phi[:, place], discs.radius[:, place]
    kappa = sheet.curvature
    h = sheet.stretch(u)
    bend = kappa * a / h
    last = float(sheet.stretch(sheet.width))
    out: list[EdgeImage] = []
    with np.errstate(divide="ignore", invalid="ignore"):
        for sign, sum_u, edge_h in ((1.0, (1.0 + h) * u, 1.0), (-1.0, (h + last) * (sheet.width - u), last)):
            alpha = sign * h * a / sum_u
            near = np.abs(alpha) > _NEAR_ALPHA
            if near.any():
                alpha = np.where(near, alpha, 0.0)
                delta = np.where(near, (a * edge_h / sum_u) ** 2, 0.0)
                out.append(EdgeImage(True, alpha.astype(np.complex128), alpha * bend, delta))
        for sign, y in zip((-1.0, 1.0), sheet.across(phi), strict=True):
            turn = kappa * y
            distance = h * y * np.sinc(turn / math.pi)
            size = 0.5 * a / distance
            near = (np.abs(turn) < 0.5 * math.pi) & (size > _NEAR_ALPHA)
            if near.any():
                size = np.where(near, size, 0.0)
                alpha_c = sign * 1j * size * np.exp(-sign * 1j * turn)
                out.append(EdgeImage(False, alpha_c, np.zeros_like(size), size * size))
    return out


def image_distance(image: EdgeImage, zeta: Complex) -> Floats:
    """Return the squared distance from each point to the image of each, to a constant, shape (n, N, N)."""
    alpha = image.alpha[:, None]
    one, two = alpha * zeta, (alpha * zeta).conj()
    z = 1.0 + one[:, :, None] + two[:, None, :]
    if image.arc and image.gamma.any():
        z += (image.gamma[:, None] * zeta)[:, :, None] * zeta.conj()
    return np.asarray(z.real * z.real + z.imag * z.imag)


@lru_cache(maxsize=64)
def _binomials(order: int) -> Floats:
    """Return C(m, k) / 2^m: without the power, products of two overflow from order 500 on."""
    out = np.zeros((order, order))
    for m in range(order):
        out[m, : m + 1] = [math.comb(m, k) / 2**m for k in range(m + 1)]
    out.setflags(write=False)
    return out


def image_coefficients(image: EdgeImage, order: int) -> Floats:
    """Return the Fourier coefficients of ln of `image_distance`, shape (n, 2M+1, 2M+1), as of the Green function."""
    m = np.arange(1, order + 1)
    size = np.abs(image.alpha)
    divisor = np.where(size > 0.0, size, 1.0)
    power = size[:, None] ** m
    weights = (np.sqrt(image.delta) / divisor)[:, None] ** (2 * m) / m
    binomials = _binomials(order)
    pair = (binomials * weights[:, None, :]) @ binomials.T
    doubled = size[:, None] * (2.0 * size[:, None]) ** (m - 1)
    pair *= doubled[:, :, None]
    pair *= doubled[:, None, :]
    turn = np.angle(-image.alpha)[:, None] * m
    cos, sin = np.cos(turn), np.sin(turn)
    out = np.zeros((size.size, 2 * order + 1, 2 * order + 1))
    single = -2.0 * power / m
    out[:, 0, 1::2] = out[:, 1::2, 0] = single * cos
    out[:, 0, 2::2] = out[:, 2::2, 0] = -single * sin
    pair *= -2.0
    even = pair * (cos[:, :, None] * cos[:, None, :] + sin[:, :, None] * sin[:, None, :])
    out[:, 1::2, 1::2] = out[:, 2::2, 2::2] = even
    if not image.arc:
        odd = pair * (sin[:, :, None] * cos[:, None, :] - cos[:, :, None] * sin[:, None, :])
        out[:, 1::2, 2::2] = odd
        out[:, 2::2, 1::2] = -odd
    return out


@lru_cache(maxsize=64)
def _pairs(order: int) -> Floats:
    """Return (m+n-1)! / (m! n!) for m, n = 1..order."""
    out = np.array([[math.comb(m + n, m) / (m + n) for n in range(1, order + 1)] for m in range(1, order + 1)])
    out.setflags(write=False)
    return out


def other_disc(sheet: SectorSheet, discs: Discs, i: int, j: int) -> tuple[Complex, Complex]:
    """Return alpha, beta of |z_i - z_j| = const |1 + alpha zeta + beta zeta'|, circle i to circle j, shape (n,)."""
    kappa = sheet.curvature
    turn = kappa * sheet.arc * (discs.phi[:, j] - discs.phi[:, i]) / sheet.wrap
    w = (sheet.along(discs.u[:, j])[0] - sheet.along(discs.u[:, i])[0]) + 1j * (
        sheet.across(discs.phi[:, j])[0] - sheet.across(discs.phi[:, i])[0]
    )
    towards = w if kappa == 0.0 else sheet.stretch(discs.u[:, i]) * np.expm1(kappa * w) / kappa
    # Beyond half a turn the flat sheet may lap over itself; the chord means nothing there.
    near = np.abs(turn) < math.pi
    alpha = np.where(near, -discs.radius[:, i] / towards, 0.0)
    beta = np.where(near, discs.radius[:, j] * np.exp(1j * turn) / towards, 0.0)
    return np.asarray(alpha, dtype=np.complex128), np.asarray(beta, dtype=np.complex128)


def pair_distance(alpha: Complex, beta: Complex, zeta: Complex) -> Floats:
    """Return |1 + alpha zeta + beta zeta'|^2, shape (n, N, N)."""
    z = (1.0 + alpha[:, None] * zeta)[:, :, None] + (beta[:, None] * zeta)[:, None, :]
    return np.asarray(z.real * z.real + z.imag * z.imag)


def pair_coefficients(alpha: Complex, beta: Complex, order: int) -> Floats:
    """Return the Fourier coefficients of ln of `pair_distance`, shape (n, 2M+1, 2M+1)."""
    m = np.arange(1, order + 1)
    out = np.zeros((alpha.size, 2 * order + 1, 2 * order + 1))
    first, second = np.abs(alpha)[:, None] ** m, np.abs(beta)[:, None] ** m
    turn1, turn2 = np.angle(-alpha)[:, None] * m, np.angle(-beta)[:, None] * m
    out[:, 1::2, 0], out[:, 2::2, 0] = -2.0 * first / m * np.cos(turn1), 2.0 * first / m * np.sin(turn1)
    out[:, 0, 1::2], out[:, 0, 2::2] = -2.0 * second / m * np.cos(turn2), 2.0 * second / m * np.sin(turn2)
    size = 2.0 * _pairs(order) * first[:, :, None] * second[:, None, :]
    turn = turn1[:, :, None] + turn2[:, None, :]
    cos, sin = size * np.cos(turn), size * np.sin(turn)
    out[:, 1::2, 1::2], out[:, 2::2, 2::2] = -cos, cos
    out[:, 1::2, 2::2] = out[:, 2::2, 1::2] = sin
    return out
