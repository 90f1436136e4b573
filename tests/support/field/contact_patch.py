"""Contact of any outline and any distribution of conductance, also one cut by an edge of the sheet.

The region is cut into cells, rings t_i < t < t_(i+1) of its outline times equal angles, each with one unknown
current. The rings thin out towards the rim, where a good contact carries its current. The logarithm between cells
is the one between rings of a circle, averaged exactly and band-limited to the directions, plus the smooth rest that
the outline adds; the images come from `green`. The six numbers of `Coupling` are stationary in the currents,
so their error is of second order in the cells.

A second method for the tests and the bench of the disc solver, with which it shares the Green function alone.

An outline is given about its own middle, as a distance for each direction; directions are measured in the flat
sheet from e_u (towards end 2) to e_phi. What lies off the sheet is cut away, and the rest is described again about
its own centroid.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.core.arrays import Complex, Floats
from coneskin.core.errors import FieldError
from coneskin.skin.field.fourport import Coupling
from coneskin.skin.field.green import Strip, StripPoints, direct_features, kernel, mirrored
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet

#: Distance of the outline [m] in each direction [rad].
Outline = Callable[[Floats], Floats]

_RAYS_PER_SECTOR = 16  # rays
_FINE_DIRECTIONS = 4096  # directions in which an outline is sampled; a chord misses (pi/4096)^2/2 = 3e-7 of the radius


@dataclass(frozen=True, slots=True, eq=False)
class _Region:
    """A piece of the sheet that can be seen whole from its centre.

    Attributes:
        u: slant distance of the centre from end 1 [m].
        phi: azimuth of the centre [rad].
        radius: in equidistant directions from 0 [m], shape (n,); with corners, of the sector of equal area.
        toward: exp(i direction), shape (n,); with corners, the sector's centroid in units of 2/3 radius.
        cut: an edge of the sheet cuts it.
    """

    u: float
    phi: float
    radius: Floats
    toward: Complex
    cut: bool


def disc(radius: float) -> Outline:
    """Return the outline of a circle [m]."""
    return lambda angle: np.full_like(angle, radius)


def ellipse(along: float, across: float, turn: float = 0.0) -> Outline:
    """Return the outline of an ellipse of two half-axes [m], the first turned from e_u by an angle [rad]."""
    return lambda angle: 1.0 / np.hypot(np.cos(angle - turn) / along, np.sin(angle - turn) / across)


def rectangle(along: float, across: float, turn: float = 0.0) -> Outline:
    """Return the outline of a rectangle of two half-sides [m], the first turned from e_u by an angle [rad]."""
    return lambda angle: 1.0 / np.maximum(np.abs(np.cos(angle - turn)) / along, np.abs(np.sin(angle - turn)) / across)


def _clip(sheet: SectorSheet, u: float, phi: float, outline: Outline, directions: int) -> _Region:
    """Return the part of an outline that lies on the sheet.

    Args:
        sheet: the sheet.
        u: slant distance of the outline's middle from end 1 [m]; may lie off the sheet.
        phi: azimuth of the middle [rad]; may lie off the sheet.
        outline: the shape.
        directions: how many to describe the result by.

    Raises:
        FieldError: nothing of it lies on the sheet, or the rest cannot be seen whole from its centroid.
    """
    angle = 2.0 * math.pi * np.arange(_FINE_DIRECTIONS) / _FINE_DIRECTIONS
    radius = np.asarray(outline(angle), dtype=np.float64)
    rim = radius * np.exp(1j * angle)
    u1, phi1, offset = u, phi, 0.0j
    cut = False
    room = sheet.edge_distances(u, phi).min() if 0.0 <= u <= sheet.width and 0.0 <= phi <= sheet.wrap else -1.0
    if radius.max() > room:
        cut = True
        u1, phi1 = _centroid(sheet, u, phi, radius, angle)
        offset = complex(sheet.flat(np.array(u), np.array(phi), (u1, phi1)))
        # The frame turns with azimuth: directions at (u, phi), seen from (u1, phi1).
        rim = offset + rim * np.exp(1j * sheet.curvature * sheet.arc * (phi - phi1) / sheet.wrap)
    seen = np.unwrap(np.angle(rim))
    if not (np.diff(seen) > 0.0).all() or seen[-1] - seen[0] > 2.0 * math.pi:
        raise FieldError("a contact cut by an edge must be visible whole from its middle; split it in two")
    if not cut and not _cornered(radius):
        ray = 2.0 * math.pi * np.arange(directions) / directions
        return _Region(u, phi, np.asarray(outline(ray), dtype=np.float64), np.exp(1j * ray), False)
    # Sectors keep the area and the centroid of the piece that they stand for, so that corners need no cell of their
    # own.
    count = directions * _RAYS_PER_SECTOR
    wanted = 2.0 * math.pi * (np.arange(count) + 0.5 - _RAYS_PER_SECTOR / 2) / count
    distance = np.exp(np.interp(wanted, seen, np.log(np.abs(rim)), period=2.0 * math.pi))
    rays = np.minimum(distance, _to_edges(sheet, u1, phi1, wanted))
    square = (rays**2).reshape(directions, _RAYS_PER_SECTOR).mean(axis=1)
    cube = (rays**3 * np.exp(1j * wanted)).reshape(directions, _RAYS_PER_SECTOR).mean(axis=1)
    # The mean direction within a sector shortens the centroid of a circle too; a ring's own curvature is exact already.
    straight = np.sinc(1.0 / directions)
    radius = np.sqrt(square)
    return _Region(u1, phi1, radius, cube / (square * radius * straight), cut)


def _cornered(radius: Floats) -> bool:
    """Tell whether the outline has corners: its slope jumps between two of the fine directions."""
    log = np.log(radius)
    return bool(np.abs(np.roll(log, 1) - 2.0 * log + np.roll(log, -1)).max() > 0.3 * 2.0 * math.pi / _FINE_DIRECTIONS)


def _centroid(sheet: SectorSheet, u: float, phi: float, radius: Floats, angle: Floats) -> tuple[float, float]:
    """Return the centroid of what lies on the sheet, in the rectangle's coordinates."""
    t = (np.arange(64) + 0.5) / 64.0
    step = angle.size // 128
    local = t[:, None] * (radius * np.exp(1j * angle))[None, ::step]
    weight = t[:, None] * (radius[None, ::step] ** 2)
    kappa = sheet.curvature
    stretch = float(sheet.stretch(u))
    w = local if kappa == 0.0 else np.log(1.0 + kappa * local / stretch) / kappa
    y0 = sheet.arc * (phi / sheet.wrap)
    x0 = u if kappa == 0.0 else math.log1p(kappa * u) / kappa
    x, y = x0 + w.real, y0 + w.imag
    inside = (x > 0.0) & (x < sheet.length) & (y > 0.0) & (y < sheet.breadth)
    if not inside.any():
        raise FieldError(f"the contact at u={u:.6g} m, phi={phi:.6g} rad lies off the sheet")
    weight = np.where(inside, weight, 0.0)
    u1, phi1 = sheet.locate((weight * x).sum() / weight.sum(), (weight * y).sum() / weight.sum())
    return float(u1), float(phi1)


def _to_edges(sheet: SectorSheet, u: float, phi: float, angle: Floats) -> Floats:
    """Return the distance from a point of the sheet to its boundary in each direction [m]."""
    kappa = sheet.curvature
    stretch = float(sheet.stretch(u))
    last = float(sheet.stretch(sheet.width))
    forward = stretch * np.cos(angle)
    out = np.full_like(angle, math.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        # kappa rho^2 + 2 rho h cos + C = 0 on either arc
        for c in ((1.0 + stretch) * u, -(sheet.width - u) * (stretch + last)):
            root = np.sqrt(forward * forward - kappa * c)
            for sign in (1.0, -1.0):
                rho = -c / (forward + sign * root)
                out = np.where(rho > 0.0, np.fmin(out, rho), out)
        for y, side in ((sheet.arc * phi / sheet.wrap, -1.0), (sheet.arc * (sheet.wrap - phi) / sheet.wrap, 1.0)):
            turn = kappa * y
            if abs(turn) < 0.5 * math.pi:
                cos = np.cos(angle - side * (0.5 * math.pi + turn))
                rho = stretch * y * np.sinc(turn / math.pi) / cos
                out = np.where(cos > 0.0, np.fmin(out, rho), out)
    return out


def rectangle_offsets(sheet: SectorSheet, local: NDArray[np.complex128], u: float) -> NDArray[np.complex128]:
    """Return the rectangle's offsets x + i y of flat offsets (e_u, e_phi) from a point at slant distance u [m]."""
    stretch = float(sheet.stretch(u))
    if sheet.curvature == 0.0:
        return local / stretch
    bent = local * (sheet.curvature / stretch)
    # numpy's complex log1p loses digits near zero; the two real functions do not.
    out = np.empty_like(local)
    np.multiply(0.5 * np.log1p(2.0 * bent.real + bent.real**2 + bent.imag**2), 1.0 / sheet.curvature, out=out.real)
    np.multiply(np.arctan2(bent.imag, 1.0 + bent.real), 1.0 / sheet.curvature, out=out.imag)
    return out


#: Conductance per area [S/m^2] at flat offsets (along e_u, along e_phi) from the middle [m].
Profile = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class ContactPatch:
    """A contact of any shape.

    Attributes:
        u: slant distance of its middle from end 1 [m].
        phi: azimuth of its middle [rad].
        outline: distance of the rim in each direction.
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
        FieldError: nothing of the patch lies on the sheet.
    """
    sheet = model.sheet
    region = _clip(sheet, patch.u, patch.phi, patch.outline, directions)
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
    w = rectangle_offsets(sheet, local, region.u)
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


def _conductance(model: FieldModel, patch: ContactPatch, region: _Region, local: NDArray[np.complex128]) -> Floats:
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
    return values


def _images(
    model: FieldModel, strip: Strip, region: _Region, local: NDArray[np.complex128], a: float, b: float
) -> Floats:
    """Return (Ra G_a + Rb G_b)/(Ra + Rb) between the cells without -ln|z - z'| / 2 pi, shape (N, N)."""
    sheet = model.sheet
    kappa, stretch = sheet.curvature, float(sheet.stretch(region.u))
    w = rectangle_offsets(sheet, local, region.u)
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
    out = kernel(strip, points, points, a, b, squared, (slope * slope)[None])[0] + _blur(points, a, b, blur)
    along = points.s[0]
    weight = float(s_far[0]) / strip.sigma
    out += (b / math.pi) * (
        float(s[0]) * weight
        + weight * (along[:, None] + along[None, :])
        - along[:, None] * along[None, :] / strip.sigma
    )
    return np.asarray(out)


def _blur(points: StripPoints, a: float, b: float, blur: Floats) -> Floats:
    """Return what the sizes of the cells (blur, squared) add to `kernel` where a cell touches its own images."""
    size = np.sqrt(blur[:, None] * blur)

    def grown(distance: Complex) -> Floats:
        squared = np.abs(distance) ** 2
        return np.log1p(size / (1.0 + (squared / (4.0 * size)) ** 2) / squared)

    near, far = points.near[0], points.near[0].conj()
    out = (a + b) * grown(near[:, None] + near - near[:, None] * near)
    if a != b:
        edge = points.folded[0][:, None] - points.folded[0].conj()
        out -= (a - b) * (grown(near[:, None] + far - near[:, None] * far) - grown(edge))
    return np.asarray(out / (4.0 * math.pi))


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
