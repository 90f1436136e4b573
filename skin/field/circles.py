"""Circles around the contacts in the rectangle, their near images, and the Green function from circle to circle.

Fourier coefficients are taken from N equidistant points on each circle. Everything is analytic there, so truncation
(order M) and aliasing (N) both fall geometrically.

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
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Complex, Floats

from .disc import Discs
from .green import Strip, StripPoints, direct_features, kernel, mirrored
from .sheet import SectorSheet

_NEAR_ALPHA = 0.25  # |alpha| of an edge that counts as near: two radii between centre and edge


@dataclass(frozen=True, slots=True, eq=False)
class _EdgeImage:
    """One edge as each of n discs sees it."""

    arc: bool  #: the edge is an arc (A or B), otherwise straight (C or D)
    alpha: Complex  #: at most 1/2 in modulus where the edge is straight; 0 where it is far, shape (n,)
    gamma: Floats  #: shape (n,)
    delta: Floats  #: shape (n,)


def _edge_images(sheet: SectorSheet, discs: Discs, place: int) -> list[_EdgeImage]:
    """Find the near edges of the discs at one place of every scene; edges that no disc is near are left out."""
    u, phi, a = discs.u[:, place], discs.phi[:, place], discs.radius[:, place]
    kappa = sheet.curvature
    h = sheet.stretch(u)
    bend = kappa * a / h
    last = float(sheet.stretch(sheet.width))
    out: list[_EdgeImage] = []
    with np.errstate(divide="ignore", invalid="ignore"):
        for sign, sum_u, edge_h in ((1.0, (1.0 + h) * u, 1.0), (-1.0, (h + last) * (sheet.width - u), last)):
            alpha = sign * h * a / sum_u
            near = np.abs(alpha) > _NEAR_ALPHA
            if near.any():
                alpha = np.where(near, alpha, 0.0)
                delta = np.where(near, (a * edge_h / sum_u) ** 2, 0.0)
                out.append(_EdgeImage(True, alpha.astype(np.complex128), alpha * bend, delta))
        for sign, y in zip((-1.0, 1.0), sheet.across(phi), strict=True):
            turn = kappa * y
            distance = h * y * np.sinc(turn / math.pi)
            size = 0.5 * a / distance
            near = (np.abs(turn) < 0.5 * math.pi) & (size > _NEAR_ALPHA)
            if near.any():
                size = np.where(near, size, 0.0)
                alpha_c = sign * 1j * size * np.exp(-sign * 1j * turn)
                out.append(_EdgeImage(False, alpha_c, np.zeros_like(size), size * size))
    return out


def _image_distance(image: _EdgeImage, zeta: Complex) -> Floats:
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


def _image_coefficients(image: _EdgeImage, order: int) -> Floats:
    """Return the Fourier coefficients of ln of `_image_distance`, shape (n, 2M+1, 2M+1), as of the Green function."""
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


def _other_disc(sheet: SectorSheet, discs: Discs, i: int, j: int) -> tuple[Complex, Complex]:
    """Return alpha, beta of |z_i - z_j| = const |1 + alpha zeta + beta zeta'|, circle i to circle j, shape (n,)."""
    turn = sheet.curvature * sheet.arc * (discs.phi[:, j] - discs.phi[:, i]) / sheet.wrap
    towards = sheet.flat(discs.u[:, j], discs.phi[:, j], (discs.u[:, i], discs.phi[:, i]))
    # Beyond half a turn the flat sheet may lap over itself; the chord means nothing there.
    near = np.abs(turn) < math.pi
    alpha = np.where(near, -discs.radius[:, i] / towards, 0.0)
    beta = np.where(near, discs.radius[:, j] * np.exp(1j * turn) / towards, 0.0)
    return np.asarray(alpha, dtype=np.complex128), np.asarray(beta, dtype=np.complex128)


def _pair_distance(alpha: Complex, beta: Complex, zeta: Complex) -> Floats:
    """Return |1 + alpha zeta + beta zeta'|^2, shape (n, N, N)."""
    z = (1.0 + alpha[:, None] * zeta)[:, :, None] + (beta[:, None] * zeta)[:, None, :]
    return np.asarray(z.real * z.real + z.imag * z.imag)


def _pair_coefficients(alpha: Complex, beta: Complex, order: int) -> Floats:
    """Return the Fourier coefficients of ln of `_pair_distance`, shape (n, 2M+1, 2M+1)."""
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


#: Place of the first point on a circle, in steps: none lies where a disc touches an edge, and both distances vanish.
PHASE = 0.3


class Centres(NamedTuple):
    """Distances of the centres of n scenes of k discs from the sides of the strip [(shorter side)/pi], shape (n, k)."""

    s: Floats
    s_far: Floats  #: from s = Sigma
    p: Floats
    p_far: Floats  #: from p = pi

    @classmethod
    def of(cls, sheet: SectorSheet, strip: Strip, discs: Discs) -> Centres:
        """Measure them."""
        x, y = sheet.along(discs.u), sheet.across(discs.phi)
        return cls(*(strip.scale * distance for side in ((x, y) if strip.along_x else (y, x)) for distance in side))


@dataclass(frozen=True, slots=True, eq=False)
class Circles:
    """The circles of n scenes of k discs in the rectangle; lengths in units of (shorter side)/pi.

    Attributes:
        order: M.
        offset: x + i y of the points from their centres, shape (n, k, N).
        slope: |d offset / d zeta| there, zeta on the unit circle, shape (n, k, N).
        centres: of the circles.
        x: Fourier coefficients of x/L, shape (n, k, 2M+1).
        y: Fourier coefficients of y/T, shape (n, k, 2M+1).
        images: near edges of each of the k discs, to be taken out of the samples.
    """

    sheet: SectorSheet
    discs: Discs
    order: int
    offset: Complex
    slope: Floats
    centres: Centres
    x: Floats
    y: Floats
    images: tuple[tuple[_EdgeImage, ...], ...] = ()


@lru_cache(maxsize=64)
def circle(order: int, points: int) -> tuple[Complex, Floats, Floats]:
    """Return points zeta, |zeta - zeta'|^2 (ones on the diagonal), and the matrix to Fourier coefficients."""
    n = points
    angle = 2.0 * math.pi * (np.arange(n) + PHASE) / n
    zeta = np.exp(1j * angle)
    squared = 4.0 * np.sin(0.5 * (angle[:, None] - angle[None, :])) ** 2
    np.fill_diagonal(squared, 1.0)
    fourier = np.empty((2 * order + 1, n))
    fourier[0] = 1.0 / n
    m = np.arange(1, order + 1)[:, None]
    fourier[1::2] = np.cos(m * angle) * (2.0 / n)
    fourier[2::2] = np.sin(m * angle) * (2.0 / n)
    for array in (zeta, squared, fourier):
        array.setflags(write=False)
    return zeta, squared, fourier


def make_circles(
    sheet: SectorSheet, strip: Strip, discs: Discs, order: int, points: int, with_images: bool = False
) -> Circles:
    """Make the circles of the discs, N points on each; images are of use between unequal sheets."""
    zeta, _, _ = circle(order, points)
    local = discs.radius / sheet.stretch(discs.u)  # a/h, the radius in the rectangle
    bend = (sheet.curvature * local)[:, :, None]  # q = a/r_c, signed
    offset, slope = _offsets(local, bend, zeta)
    x, y = sheet.along(discs.u)[0], sheet.across(discs.phi)[0]
    m = np.arange(1, order + 1)
    series = local[:, :, None] * (-bend) ** (m - 1) / m
    fx = np.zeros((*local.shape, 2 * order + 1))
    fy = np.zeros_like(fx)
    fx[:, :, 0] = x / sheet.length
    fx[:, :, 1::2] = series / sheet.length
    fy[:, :, 0] = y / sheet.breadth
    fy[:, :, 2::2] = series / sheet.breadth
    k = strip.scale
    places = range(discs.u.shape[1]) if with_images else ()
    images = tuple(tuple(_edge_images(sheet, discs, place)) for place in places)
    return Circles(sheet, discs, order, offset * k, slope * k, Centres.of(sheet, strip, discs), fx, fy, images)


def _offsets(local: Floats, bend: Floats, zeta: Complex) -> tuple[Complex, Floats]:
    """Return offsets in the rectangle from the centres to points of the rims, and |d offset / d zeta| [m]."""
    if not bend.any():
        offset = local[:, :, None] * zeta
        return offset, np.broadcast_to(local[:, :, None], offset.shape)
    cos, sin = zeta.real, zeta.imag
    offset = np.empty((*local.shape, zeta.size), dtype=np.complex128)
    over = local[:, :, None] / bend
    # numpy's complex log1p loses digits near zero; the two real ones do not.
    np.multiply(0.5 * np.log1p(bend * (2.0 * cos + bend)), over, out=offset.real)
    np.multiply(np.arctan2(bend * sin, 1.0 + bend * cos), over, out=offset.imag)
    return offset, local[:, :, None] / np.sqrt(1.0 + bend * (2.0 * cos + bend))


def pair_points(
    strip: Strip, centres: Centres, offsets: Sequence[Complex] | Complex, i: int, j: int, equal: bool
) -> tuple[StripPoints, StripPoints, Floats, Floats, Floats]:
    """Return the points of discs i and j, mirrored to the near corner, and the linear part of the Green function.

    The offsets are those of the points of each disc from its centre, unmirrored, shape (n, N) each.

    That part is s_lo (Sigma - s_hi) / Sigma + (s_hi - s_ref) with s_ref the higher centre. Returned are its weights
    on the offsets of i and of j and its value at the centres, so that a long strip loses nothing by that large
    value.
    """
    flip_s = centres.s[:, i] + centres.s[:, j] > centres.s_far[:, i] + centres.s_far[:, j]
    flip_p = centres.p[:, i] + centres.p[:, j] > centres.p_far[:, i] + centres.p_far[:, j]
    s = [np.where(flip_s, centres.s_far[:, d], centres.s[:, d]) for d in (i, j)]
    rest = [np.where(flip_s, centres.s[:, d], centres.s_far[:, d]) for d in (i, j)]
    p = [np.where(flip_p, centres.p_far[:, d], centres.p[:, d]) for d in (i, j)]
    i_high = s[0] >= s[1]
    high, low, p_ref = np.where(i_high, s[0], s[1]), np.where(i_high, s[1], s[0]), np.where(i_high, p[0], p[1])
    made = []
    for place, d in enumerate((i,) if i == j else (i, j)):
        offset = mirrored(offsets[d], strip.along_x, flip_s, flip_p)
        made.append(direct_features(strip, offset, s[place], p[place], high, p_ref, equal))
    above = np.where(i_high, rest[0], rest[1])
    weight_high, weight_low = 1.0 - low / strip.sigma, above / strip.sigma
    weight_i = np.where(i_high, weight_high, weight_low)
    weight_j = np.where(i_high, weight_low, weight_high)
    return made[0], made[-1], weight_i, weight_j, low * above / strip.sigma


def green_block(
    strip: Strip, circles: Circles, i: int, j: int, resistance_a: float, resistance_b: float
) -> tuple[Floats, Floats]:
    """Compute the Fourier coefficients of the Green function from disc j to disc i, shape (n, 2M+1, 2M+1).

    On the disc itself its own logarithm, ln(|z - z'|/radius) (Ra + Rb)/(2 pi), is left out.

    Returns:
        the coefficients, and an estimate of the aliasing in them, shape (n,).
    """
    zeta, squared, fourier = circle(circles.order, circles.offset.shape[2])
    first, second, weight_i, weight_j, centre = pair_points(
        strip, circles.centres, circles.offset.swapaxes(0, 1), i, j, resistance_a == resistance_b
    )
    if i == j:
        slope = circles.slope[:, i] * np.abs(1.0 + first.direct)
        taken, put_back = _near_images(strip, circles, i, zeta)
        values = kernel(strip, first, second, resistance_a, resistance_b, squared, slope * slope, taken=taken)
    else:
        alpha, beta = _other_disc(circles.sheet, circles.discs, i, j)
        values = kernel(strip, first, second, resistance_a, resistance_b, _pair_distance(alpha, beta, zeta))
    b = resistance_b / math.pi
    values += ((b * weight_i)[:, None] * first.s)[:, :, None] + ((b * weight_j)[:, None] * second.s)[:, None, :]
    values -= (b / strip.sigma) * (first.s[:, :, None] * second.s[:, None, :])
    n, points, _ = values.shape
    half = (values.reshape(-1, points) @ fourier.T).reshape(n, points, -1).transpose(0, 2, 1)
    block = (half.reshape(-1, points) @ fourier.T).reshape(n, fourier.shape[0], -1).transpose(0, 2, 1)
    aliased = _aliasing(block, circles.order)
    block[:, 0, 0] += b * centre
    if i != j:
        both = resistance_a + resistance_b
        block -= both / (4.0 * math.pi) * _pair_coefficients(alpha, beta, circles.order)
    elif put_back is not None:
        block -= (resistance_a - resistance_b) / (4.0 * math.pi) * put_back
    return block, aliased


def _aliasing(sampled: Floats, order: int) -> Floats:
    """Estimate the coefficient of order 2M, which N = 2M + 2 points take for one of the lowest, shape (n,)."""
    size = np.maximum(np.abs(sampled[:, 0, 1:]), np.abs(sampled[:, 1:, 0]))
    window = 2 * max(2, order // 8)
    last = size[:, -window:].max(axis=1)
    if order < 4:
        return np.asarray(last)
    middle = size[:, order // 2 * 2 - window : order // 2 * 2].max(axis=1)
    return np.asarray(10.0 * last * np.minimum(last / np.maximum(middle, 1e-300), 1.0) ** 2)


def _near_images(strip: Strip, circles: Circles, i: int, zeta: Complex) -> tuple[Floats | None, Floats | None]:
    """Return the near edges' part of A2/A3 on disc i, and the Fourier coefficients of its logarithm."""
    if not circles.images or not circles.images[i]:
        return None, None
    taken: Floats | None = None
    put_back: Floats | None = None
    for image in circles.images[i]:
        # A2 holds the images in the ends of the strip, A3 those in its long edges.
        at_end = image.arc == strip.along_x
        distance, logarithm = _image_distance(image, zeta), _image_coefficients(image, circles.order)
        if not at_end:
            distance, logarithm = 1.0 / distance, -logarithm
        taken = distance if taken is None else taken * distance
        put_back = logarithm if put_back is None else put_back + logarithm
    return taken, put_back
