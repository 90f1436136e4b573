"""Contact of any outline and any distribution of conductance, also one cut by an edge of the sheet.

The region is cut into cells, rings t_i < t < t_(i+1) of its outline times equal angles, each with one unknown
current. The rings thin out towards the rim, where a good contact carries its current. The logarithm between cells
is the one between rings of a circle, averaged exactly and band-limited to the directions, plus the smooth rest that
the outline adds; the images come from `green`. The six numbers of `Coupling` are stationary in the currents,
so their error is of second order in the cells.

For programs that model contacts of their own shape, and a second method for the tests of the disc solver, with which it
shares the Green function alone. No scene and no command uses it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.core.errors import FieldError

from .coupling import Coupling
from .green import Strip, direct_features, kernel, mirrored
from .model import FieldModel
from .shape import Outline, Region, clip

__all__ = ["ContactPatch", "solve_patch"]

Floats = NDArray[np.float64]

#: Conductance per area [S/m^2] at flat offsets (along e_u, along e_phi) from the middle [m].
Profile = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class ContactPatch:
    """A contact of any shape.

    Attributes:
        u: slant distance of its middle from end 1 [m].
        phi: azimuth of its middle [rad].
        outline: distance of the rim in each direction (see `shape`).
        conductance: per area [S/m^2], a number (inf is a perfect bond) or a function of the flat offsets (along e_u,
            along e_phi) from the middle [m].
    """

    u: float
    phi: float
    outline: Outline
    conductance: float | Profile = math.inf


def solve_patch(model: FieldModel, patch: ContactPatch, directions: int = 48, rings: int = 10) -> Coupling:
    """Compute the coupling of one patch.

    Args:
        model: the sensor.
        patch: what touches.
        directions: cells around, even, at least 8.
        rings: cells from the middle to the rim, at least 2.

    Raises:
        FieldError: nothing of the patch lies on the sheet, or a conductance is negative or NaN.
    """
    if directions < 8 or directions % 2 or rings < 2:
        raise FieldError(f"a patch needs an even number of directions >= 8 and >= 2 rings, got {directions}, {rings}")
    sheet = model.sheet
    region = clip(sheet, patch.u, patch.phi, patch.outline, directions)
    toward = region.toward
    edges = _ring_edges(rings)
    inner, outer = edges[:-1], edges[1:]
    middle = (2.0 / 3.0) * (outer**3 - inner**3) / (outer**2 - inner**2)
    local = (middle[:, None] * (region.radius * toward)).ravel()
    area = ((outer**2 - inner**2)[:, None] * (region.radius**2 * (math.pi / directions))).ravel()
    conductance = _conductance(model, patch, region, local)

    strip = Strip.of(sheet.length, sheet.breadth)
    rs = model.upper_resistance + model.lower_resistance
    upper, lower = model.upper_resistance / rs, model.lower_resistance / rs
    a, b = (lower, upper) if strip.along_x else (upper, lower)
    green = _images(model, strip, region, local, a, b)
    green -= _logarithm(region.radius, toward, inner, outer, middle) / (2.0 * math.pi)
    w = sheet.offsets(local, region.u)
    x0, y0 = float(sheet.along(region.u)[0]), float(sheet.across(region.phi)[0])
    right = np.stack([np.ones_like(area), (x0 + w.real) / sheet.length, (y0 + w.imag) / sheet.breadth], axis=1)
    # Scaled so that a cell without conductance drops out.
    if region.cut:
        # Touching its own images, a perfect bond is ill-posed between cells; a layer of 1/300 of the radius is not.
        conductance = np.minimum(conductance, 9e4 / (rs * float(np.mean(region.radius**2))))
    root = np.sqrt(conductance * rs * area)
    index = np.arange(area.size)
    bonded = np.isinf(root)
    scale = np.where(bonded, 1.0, root)
    matrix = green * scale[:, None] * scale
    matrix[index, index] += np.where(bonded, 0.0, 1.0)
    right *= scale[:, None]
    w3 = right.T @ np.linalg.solve(matrix, right) / rs
    fallback = np.array([[x0 / sheet.length, y0 / sheet.breadth]])
    return Coupling.of_matrix(0.5 * (w3 + w3.T)[None], fallback)


def _ring_edges(rings: int) -> Floats:
    """Return the edges of the rings, thinner towards the rim with the cube of the distance from it."""
    edges: Floats = 1.0 - (1.0 - np.arange(rings + 1) / rings) ** 3
    return edges


def _conductance(model: FieldModel, patch: ContactPatch, region: Region, local: NDArray[np.complex128]) -> Floats:
    if callable(patch.conductance):
        sheet = model.sheet
        turn = sheet.curvature * sheet.arc * (region.phi - patch.phi) / sheet.wrap
        back = np.zeros((), dtype=np.complex128)
        if (region.u, region.phi) != (patch.u, patch.phi):
            back = sheet.flat(np.array(region.u), np.array(region.phi), (patch.u, patch.phi))
        offset = back + local * np.exp(1j * turn)
        values = np.asarray(patch.conductance(offset.real, offset.imag), dtype=np.float64)
    else:
        values = np.full(local.shape, patch.conductance)
    if not (values >= 0.0).all():
        raise FieldError(f"conductance of a patch must be 0 or more [S/m^2], got {values[~(values >= 0.0)].flat[0]}")
    return values


def _images(
    model: FieldModel, strip: Strip, region: Region, local: NDArray[np.complex128], a: float, b: float
) -> Floats:
    """Return (Ra G_a + Rb G_b)/(Ra + Rb) between the cells without -ln|z - z'| / 2 pi, shape (N, N)."""
    sheet = model.sheet
    kappa, stretch = sheet.curvature, float(sheet.stretch(region.u))
    w = sheet.offsets(local, region.u)
    x, x_far = (np.array([float(v)]) for v in sheet.along(region.u))
    y, y_far = (np.array([float(v)]) for v in sheet.across(region.phi))
    s, s_far, p, p_far = (x, x_far, y, y_far) if strip.along_x else (y, y_far, x, x_far)
    k = strip.scale
    flip_s, flip_p = s > s_far, p > p_far
    s, s_far, p = (np.where(flip_s, s_far, s) * k, np.where(flip_s, s, s_far) * k, np.where(flip_p, p_far, p) * k)
    offset = mirrored((w * k)[None], strip.along_x, flip_s, flip_p)
    points = direct_features(strip, offset, s, p, s, p, a == b)
    squared = np.abs(local[:, None] - local[None, :]) ** 2
    np.fill_diagonal(squared, 1.0)
    slope = k / np.abs(stretch + kappa * local) * np.abs(1.0 + points.direct[0])
    # A segment of length l that lies on its own image sees it at exp(-3/2) l.
    width = 2.0 * math.pi / region.radius.size * np.abs(local)
    blur = (math.exp(-1.5) * width * k / np.abs(stretch + kappa * local)) ** 2
    out = kernel(strip, points, points, a, b, squared, (slope * slope)[None], blur[None])[0]
    along = points.s[0]
    weight = float(s_far[0]) / strip.sigma
    out += (b / math.pi) * (
        float(s[0]) * weight
        + weight * (along[:, None] + along[None, :])
        - along[:, None] * along[None, :] / strip.sigma
    )
    return np.asarray(out)


def _logarithm(radius: Floats, toward: NDArray[np.complex128], inner: Floats, outer: Floats, middle: Floats) -> Floats:
    """Average ln|z - z'| over pairs of cells, shape (N, N), N = rings times directions."""
    rings, directions = middle.size, radius.size
    step = 2.0 * math.pi / directions
    m = np.arange(1, directions // 2 + 1)
    # Of a unit disc: ln t_> - sum over m of (t_</t_>)^m cos(m angle)/m, averaged over each ring with weight t.
    log_mean, log_self, up, down, same = _ring_averages(inner, outer, m)
    order = np.arange(rings)
    larger = np.maximum(order[:, None], order[None, :])
    smaller = np.minimum(order[:, None], order[None, :])
    base = log_mean[larger]
    base[order, order] = log_self
    series = up[smaller] * down[larger]
    series[order, order] = same
    waves = np.cos(m[:, None] * (step * np.arange(directions)[None, :])) / m[:, None]
    waves[-1] *= 0.5  # the highest frequency is seen once
    circle = base[:, :, None] - series @ waves  # (rings, rings, difference of direction)
    difference = (np.arange(directions)[:, None] - np.arange(directions)[None, :]) % directions
    out = circle[:, :, difference]  # (rings, rings, directions, directions)
    # The rest: ln|z - z'| - ln|zeta - zeta'| of the outline against the unit circle.
    zeta = np.exp(1j * step * np.arange(directions))
    z = (middle[:, None] * (radius * toward)).ravel()
    unit = (middle[:, None] * zeta).ravel()
    ratio = np.abs(z[:, None] - z[None, :])
    np.fill_diagonal(ratio, 1.0)
    apart = np.abs(unit[:, None] - unit[None, :])
    np.fill_diagonal(apart, 1.0)
    rest = np.log(ratio / apart)
    # At the cell itself the map has the stretches R and R' (skewed): their mean over directions is the mean of the
    # singular values.
    slope = np.gradient(np.concatenate([radius[-1:], radius, radius[:1]]), step)[1:-1]
    mean = 0.5 * np.sqrt(4.0 * radius * radius + slope * slope)
    np.fill_diagonal(rest, np.tile(np.log(mean), rings))
    return np.asarray(out.transpose(0, 2, 1, 3).reshape(rings * directions, rings * directions) + rest)


def _ring_averages(inner: Floats, outer: Floats, m: NDArray[np.int64]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Average over rings, weight t: ln t, ln t_> within one ring, t^m, t^-m, (t_</t_>)^m within one.

    t^m and t^-m are taken relative to the outer edge of the ring before, so that neither overflows; only their product
    across rings has a meaning.
    """
    half = 0.5 * (outer**2 - inner**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_in = np.where(inner > 0.0, np.log(np.where(inner > 0.0, inner, 1.0)), 0.0)
        log_mean = (0.5 * (outer**2 * np.log(outer) - inner**2 * log_in) - 0.5 * half) / half
        # mean of ln max(t, t'): (1/half^2) 2 int t ln t (t^2 - inner^2)/2 dt
        log_self = _integral_log_max(inner, outer, log_in) / half**2
    up = _mean_power(inner, outer, m) / half[:, None]
    down = _mean_power(inner, outer, -m) / half[:, None]
    down[0] = 0.0  # the innermost ring is never the larger one
    # within a ring: 2 int_in^out t^(1-m) int_in^t t'^(1+m) dt' dt / half^2
    same = np.empty((inner.size, m.size))
    full = 2.0 / (m + 2.0) * 0.25 * (outer**4 - inner**4)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        tail = np.where(
            inner[:, None] > 0.0,
            2.0 / (m + 2.0) * inner[:, None] ** 2 * _scaled_tail(inner, outer, m),
            0.0,
        )
    same[:] = (full - tail) / half[:, None] ** 2
    return log_mean, log_self, up, down, same


def _integral_log_max(inner: Floats, outer: Floats, log_in: Floats) -> Floats:
    """Integrate 2 int_in^out t ln t (t^2 - in^2)/2 dt."""

    def fourth(t: Floats, log: Floats) -> Floats:
        return 0.25 * t**4 * log - t**4 / 16.0

    def second(t: Floats, log: Floats) -> Floats:
        return 0.5 * t**2 * log - t**2 / 4.0

    log_out = np.log(outer)
    return (fourth(outer, log_out) - fourth(inner, log_in)) - inner**2 * (
        second(outer, log_out) - second(inner, log_in)
    )


def _mean_power(inner: Floats, outer: Floats, m: NDArray[np.int64]) -> Floats:
    """Integrate t^(m+1) from in to out, shape (rings, orders)."""
    power = m + 2.0
    with np.errstate(divide="ignore", invalid="ignore"):
        value = (outer[:, None] ** power - inner[:, None] ** power) / power
        log = np.log(outer / inner)[:, None]
    return np.where(power == 0.0, log, value)


def _scaled_tail(inner: Floats, outer: Floats, m: NDArray[np.int64]) -> Floats:
    """Integrate t^(1-m) from in to out, times in^m, shape (rings, orders)."""
    power = 2.0 - m
    ratio = (outer / inner)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        value = inner[:, None] ** 2 * (ratio**power - 1.0) / power
        log = inner[:, None] ** 2 * np.log(ratio)
    return np.where(power == 0.0, log, value)
