"""Green function of the two sheets together, without cancellation.

In the rectangle of `sheet`, call the shorter side P (coordinate p) and the longer S (coordinate s), and
measure both in units of P/pi: p in [0, pi], s in [0, Sigma], Sigma >= pi. Sheet a has its electrodes across p
(resistance Ra), sheet b across s (Rb); the other two edges of each insulate. With -lap G = delta, summing the
images of a strip gives

    Ra G_a + Rb G_b = -(1/4 pi) [ (Ra+Rb) ln(A1/A4) + (Ra-Rb) ln(A2/A3) ] + (Rb/pi) linear

where A1..A4 are the squared moduli of one theta function at w-w', w+w'*, w-w'*, w+w'. Images in edges (A2, A3)
carry the *difference* of the sheets: between equal sheets only the images in the corners (A4) remain. Each theta
function is its leading factor, written with expm1, times a series in q = exp(-Sigma) <= 0.0433 whose n-th term
falls like q^(n^2).

Every point set is first mirrored so that the contact lies in the quarter next to the corner p = s = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.core.arrays import Complex, Floats


@dataclass(frozen=True, slots=True)
class Strip:
    """The rectangle seen from its shorter side."""

    sigma: float  #: longer side, in units of (shorter side)/pi
    scale: float  #: pi/(shorter side) [1/m]
    along_x: bool  #: the longer side lies along x

    @classmethod
    def of(cls, length: float, breadth: float) -> Strip:
        """Make the strip of a rectangle of that length (x) and breadth (y) [m]."""
        short, long = min(length, breadth), max(length, breadth)
        return cls(sigma=math.pi * (long / short), scale=math.pi / short, along_x=breadth <= length)

    @property
    def terms(self) -> int:
        """Number of terms of the theta series that still count in double precision."""
        # Contacts lie in the near half, so |t| <= exp(1.5 Sigma): the n-th term is at most exp(-(n(n+1) - 1.5n) Sigma).
        return next(n for n in range(8) if ((n + 1) * (n + 2) - 1.5 * (n + 1)) * self.sigma > 39.0)


@dataclass(frozen=True, slots=True)
class StripPoints:
    """Points of the strip with the exponentials that the kernel multiplies; the last axis runs over the points."""

    s: Floats  #: distance along s from the centre, shape (n, N)
    direct: Complex  #: expm1(w - w_ref)
    folded: Complex  #: expm1(w - s_ref), with p measured from the near edge
    near: Complex  #: 1 - exp(-w), measured from the near corner
    x_near: Complex  #: exp(-w)
    x_far: Complex  #: exp(w - Sigma)


def mirrored(offset: Complex, along_x: bool, flip_s: NDArray[np.bool_], flip_p: NDArray[np.bool_]) -> Complex:
    """Return offsets x + i y [units of P/pi], shape (n, N), as s + i p, mirrored for each contact (flips (n,))."""
    s, p = (offset.real, offset.imag) if along_x else (offset.imag, offset.real)
    out = np.empty_like(offset)
    np.multiply(s, np.where(flip_s, -1.0, 1.0)[:, None], out=out.real)
    np.multiply(p, np.where(flip_p, -1.0, 1.0)[:, None], out=out.imag)
    return out


def direct_features(
    strip: Strip, offset: Complex, s: Floats, p: Floats, s_ref: Floats, p_ref: Floats, equal: bool
) -> StripPoints:
    """Prepare points at centre (s, p) + offset, shapes (n,) and (n, N).

    Args:
        offset: from the centre, mirrored.
        s: distance of the centre from the near end.
        p: distance of the centre from the near edge.
        s_ref: common reference of both point sets, at least as large as either s.
        p_ref: common reference of both point sets.
        equal: the sheets are equal, so nothing folded is needed.
    """
    shift = (s - s_ref)[:, None]
    moved = offset + (shift + 1j * (p - p_ref)[:, None])
    w = offset + (s + 1j * p)[:, None]
    near = -np.expm1(-w)
    return StripPoints(
        s=offset.real,
        direct=np.expm1(moved),
        folded=moved if equal else np.expm1(offset + (shift + 1j * p[:, None])),
        near=near,
        x_near=np.asarray(1.0 - near, dtype=np.complex128),
        x_far=np.exp(w - strip.sigma),
    )


def _theta(t: Complex, q2: float, terms: int) -> Complex | float:
    """Return the sum of (-1)^n q^(n(n-1)) v_n with v_0 = 1, v_1 = q^2 + t, v_(n+1) = t v_n - q^4 v_(n-1)."""
    if terms == 0:
        return 1.0
    v_before: Complex | float = 1.0
    v = t + q2
    total = 1.0 - v
    for n in range(2, terms + 1):
        v_before, v = v, t * v - (q2 * q2) * v_before
        total += (-1.0) ** n * q2 ** (n * (n - 1) // 2) * v
    return total


def _square(z: Complex) -> Floats:
    return z.real * z.real + z.imag * z.imag


def kernel(
    strip: Strip,
    first: StripPoints,
    second: StripPoints,
    resistance_a: float,
    resistance_b: float,
    singular: Floats | None = None,
    diagonal: Floats | None = None,
    taken: Floats | None = None,
) -> Floats:
    """Compute Ra G_a + Rb G_b between every pair of points, without its linear part, shape (n, N, N').

    Args:
        first: field points, shape (n, N).
        second: source points, shape (n, N').
        resistance_a: of the sheet with electrodes across the shorter side.
        resistance_b: of the other sheet.
        singular: |z - z'|^2/a^2 of the pairs, divided out of A1, shape (N, N'); nowhere zero.
        diagonal: A1 of each point with itself, after that division, shape (n, N).
        taken: divided out of A2/A3, shape (n, N, N').
    """
    equal = resistance_a == resistance_b
    terms = strip.terms
    q = math.exp(-strip.sigma)
    q2 = q * q
    x1, f1 = first.x_near[:, :, None], first.x_far[:, :, None]
    x2, f2 = second.x_near[:, None, :], second.x_far[:, None, :]
    n1, n2 = first.near[:, :, None], second.near[:, None, :]

    direct = _square(first.direct[:, :, None] - second.direct[:, None, :])
    if singular is not None:
        direct /= singular
    if diagonal is not None:
        index = np.arange(diagonal.shape[1])
        direct[:, index, index] = diagonal
    corner = _square(n1 + n2 - n1 * n2)
    if terms:
        direct *= _square(np.asarray(_theta(q * (f1 * x2 + x1 * f2), q2, terms)))
        corner *= _square(np.asarray(_theta(f1 * f2 + q2 * (x1 * x2), q2, terms)))
    out = np.log(direct / corner)
    out *= -(resistance_a + resistance_b) / (4.0 * math.pi)
    if equal:
        return out
    x2c, f2c, n2c = x2.conj(), f2.conj(), n2.conj()
    end = _square(n1 + n2c - n1 * n2c)
    edge = _square(first.folded[:, :, None] - second.folded.conj()[:, None, :])
    if terms:
        end *= _square(np.asarray(_theta(f1 * f2c + q2 * (x1 * x2c), q2, terms)))
        edge *= _square(np.asarray(_theta(q * (f1 * x2c + x1 * f2c), q2, terms)))
    if taken is not None:
        edge *= taken
    ratio = np.log(end / edge)
    ratio *= -(resistance_a - resistance_b) / (4.0 * math.pi)
    out += ratio
    return out
