"""One scene at a time: the moments of `multipole`, their coupling by power series, at the order that is asked for.

In the strip of `green` the Green function is four logarithms of one function, 2 sinh(z/2) times its images, at
z = w -+ w' and w -+ w'*. About the centres of two discs each has a Taylor series f_n in the offsets delta and delta',
and the rim's point zeta lies at delta = (c/b) log(1 + b zeta). So the Fourier coefficients from rim to rim are

    K = T^t H T',     H_jk = C(j+k, j) f_(j+k),     T_jm = (c/b)^j b^m j! s(m, j) / m!     (s: Stirling, first kind).

Nothing is sampled: up to rounding, the order is the only error. Where a series cancels, rounding grows by how much
longer its terms are than the way to the singularity. Such scenes are left to `multipole`. One Cholesky factor holds
the solution of every order up to M. From how they differ follows the achieved error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from coneskin.core.arrays import Complex, Floats

from .disc import bessel_ratios
from .fourport import Coupling
from .green import Strip
from .sheet import SectorSheet

_MAX_ORDER = 32
_ROUNDING_ERROR = 4e-16  # of a coefficient whose series does not cancel
_FAR_DISTANCE = 40.0  # distance along the strip from which on exp(-s) is nothing beside 1
_FIRST_SIZE = 0.2  # of what order 0 leaves out; fitted so that few scenes need a second attempt
_TYPICAL_ORDER = 3.0  # order of the multipoles of which most depends
_REFLECTION_POWER = 4.0
_MIN_RATE = 0.2  # slower than that, the order would be too high
_SAFETY_FACTOR = 4.0  # on the rest of a geometric series
_MIN_IMAGE = 0.25  # share of the strip's length that images in both ends must be away
_MAX_DENSE_ORDER = 8  # measured: above, two smaller products take less time than one
_MIN_TERM = 1e-3  # of the tolerance: size of an image that no longer counts


@cache
def _rim_powers(order: int) -> tuple[Floats, Floats]:
    """Return j! s(m, j) / m! with m = 0 last, and C(j+k, j), shape (M+1, M+1)."""
    size = order + 1
    rim = np.zeros((size, size))
    rim[0, -1] = 1.0
    for m in range(1, size):
        for j in range(1, m + 1):
            rim[j, m - 1] = (j * rim[j - 1, m - 2] - (m - 1) * (rim[j, m - 2] if m > 1 else 0.0)) / m
    binomials = np.array([[math.comb(j + k, j) for k in range(size)] for j in range(size)], dtype=np.float64)
    return rim, binomials


@cache
def _log_series(order: int) -> tuple[Floats, Floats]:
    """Return f_0..f_n of L = log(1 - exp(-z)) by L and powers of 1/(exp(z) - 1), and of log(sinh(t/2) / (t/2)) at 0."""
    near = np.zeros((order + 1, order + 1))
    near[0, 0] = near[1, 1] = 1.0
    k = np.arange(1, order + 1)
    for n in range(2, order + 1):
        near[1:, n] = -k / n * near[1:, n - 1]
        near[2:, n] -= k[:-1] / n * near[1:-1, n - 1]
    own = np.zeros(order + 1)
    j = np.arange(4000.0, 0.0, -1.0)
    for n in range(2, order + 1, 2):
        zeta = {2: math.pi**2 / 6.0, 4: math.pi**4 / 90.0}.get(n, float((j**-n).sum()))
        own[n] = -((-1.0) ** (n // 2)) * 2.0 * zeta / (n * (2.0 * math.pi) ** n)
    return near, own


class _Tables(NamedTuple):
    """What k discs at an order M in one model need, wherever they are; Fourier coefficient 0 last.

    Attributes:
        series: f_0..f_2M of log, f_1, a disc on itself, powers of 1/(exp(z) - 1), and exp(n z), n of the `_waves`.
        mix: of the series (at w + w' and w - w' conjugate, at w + w'* and w - w'* not) to H_jk of k even and odd, and
            there to the rows of the real and of the imaginary parts; shape (2M+1, 4, kinds).
        spread: from these, k even before k odd, to the Fourier coefficients m, n; without powers of r.
        dense: both at once; None where the order is so high that this takes longer.
        linear: what offset times offset adds to the blocks, or to H_11 half where they are not at once.
        grid: the matrix without its blocks: below them what x/L and y/T are on the rims.
        lift: what the scaled diagonal lacks; at the charges so much that only what is left of their rows is read.
        kept: rows of the charges, of x/L and of y/T.
    """

    series: Complex
    mix: Complex
    spread: Floats
    dense: Complex | None
    linear: Complex
    grid: Complex
    lift: Floats
    kept: Any


class _Place(NamedTuple):
    """A disc in the strip [(shorter side)/pi]: distances from ends and edges, r, the largest |delta|; and ka."""

    x: float
    y: float
    s: float
    s_far: float
    p: float
    p_far: float
    radius: float
    reach: float
    ka: float


class SceneSolver:
    """Solver of single scenes on two sheets. It keeps what depends on these and on the order only."""

    def __init__(self, sheet: SectorSheet, upper: float, lower: float, tolerance: float) -> None:
        self._sides = sheet.length, sheet.breadth
        strip = Strip.of(sheet.length, sheet.breadth)
        self._sheet, self._tolerance, self._total = sheet, tolerance, upper + lower
        self._scale, self._sigma, self._turn = strip.scale, strip.sigma, 1.0 + 0j if strip.along_x else -1j
        along, across = (upper, lower) if strip.along_x else (lower, upper)
        self._linear = along / self._total / (math.pi * self._sigma)
        self._odd = (across - along) / self._total
        self._log_odd = math.log(abs(self._odd)) if self._odd else -math.inf
        self._bend = sheet.curvature / (2.0 * strip.scale) * self._turn
        aspect = sheet.length / sheet.breadth
        self._units = tuple(r / self._total for r in (upper * aspect, math.sqrt(upper * lower), lower / aspect))
        self._digits = math.log(1.0 / (_MIN_TERM * self._tolerance))
        count = math.ceil(self._digits / (_MIN_IMAGE * self._sigma))
        self._waves = np.arange(1.0, count + 1.0).repeat(2) * np.tile((1.0, -1.0), count)
        self._tables: dict[tuple[int, int], _Tables] = {}
        self._factorise: Any = None  # with the first table: a guard that solves nothing does not wait for scipy

    def _of_order(self, order: int, k: int) -> _Tables:
        from scipy.linalg.lapack import dpotrf

        self._factorise = dpotrf
        rim, binomials = _rim_powers(order)
        near, own = _log_series(2 * order)
        j, n = np.arange(order + 1), np.arange(2 * order + 1)
        turn, curvature, size = self._turn, self._sheet.curvature / self._scale, np.abs(self._waves)
        factorials = np.array([float(math.factorial(m)) for m in n.tolist()])[:, None]
        size *= np.expm1(np.minimum(2.0 * self._sigma * size, 600.0))
        images = -(self._waves ** n[:, None]) / (size * factorials)
        own = own * (1.0 - (curvature / turn) ** n).real - 0.5 * (n == 1)
        series = np.column_stack([near[0], n == 1, own, near[1:].T, images]) * turn.conjugate() ** n[:, None]
        # b is everywhere the same multiple of r, so b^(m-j) r^j is a power of it times r^m
        rim = rim * curvature ** np.maximum(np.array([*j[1:], 0.0]) - j[:, None], 0.0)
        spread = np.zeros((order + 1, order + 1, 2, n.size))
        for column in j.tolist():
            ends = rim * binomials[:, column : column + 1]
            spread[:, :, column % 2, column : column + order + 1] += ends.T[:, None] * rim[column, :, None]
        each = np.empty((2, 2, n.size, 4), dtype=np.complex128)
        square, parts = (turn * turn).real, np.array([[1.0], [1j]], dtype=np.complex128)
        each[..., 0], each[0, ..., 1], each[1, ..., 1] = parts.conj(), -parts.conj(), parts.conj()
        crossed = -self._odd * square**n * parts
        each[0, ..., 2], each[0, ..., 3] = crossed, -crossed
        each[1, ..., 2:] = square * crossed[..., None]
        each = each[..., : 4 if self._odd else 2] / (2.0 * math.pi)
        mix, dense = each.transpose(2, 0, 1, 3).reshape(n.size, 4, -1), None
        if order <= _MAX_DENSE_ORDER:
            even, odd = (spread[:, None, :, parity, :, None] * each[parity, :, None] for parity in (0, 1))
            dense = (even + odd).reshape(2 * rim.size, -1)
        offset = (parts + square * parts.conj()) * (-0.25 * self._linear)
        linear = np.outer(rim[1], rim[1])[:, :, None] * (2.0 * offset[:, 0])
        first, size = 2 * k * order, 2 * k * (order + 1)  # row of the first charge, and rows without x/L and y/T
        grid = np.zeros((size + 2, size // 2 + 1), dtype=np.complex128)
        slopes = rim[1, :-1].repeat(k) / self._scale
        grid[size:, : first // 2] = slopes / self._sides[0], 1j * slopes / self._sides[1]
        lift = np.array([*[1.0] * first, *[1e30] * (size + 2 - first)])
        kept = np.array([*range(first, size, 2), size, size + 1])
        linear = linear.swapaxes(1, 2)[..., None] if dense is not None else offset
        return _Tables(series, mix, spread.reshape(rim.size, -1), dense, linear, grid, lift, kept)

    def _place(
        self, u: float, phi: float, radius: float, ka: float, answer: float, rates: list[tuple[float, float]]
    ) -> _Place | None:
        """Return where a disc is, and add to the `_rates`; None unless it lies within the sheet and off its edges."""
        sheet, scale = self._sheet, self._scale
        kappa, x, x_far = sheet.curvature, u, sheet.width - u
        stretch = 1.0 + kappa * u
        y, y_far = sheet.arc * (phi / sheet.wrap), sheet.arc * ((sheet.wrap - phi) / sheet.wrap)
        end, side = min(x, x_far), min(y, y_far)
        if not (end > 0.0 and side > 0.0):
            return None
        if kappa != 0.0:
            turn = abs(kappa) * side
            side = math.sin(turn) * stretch / abs(kappa) if turn < 0.5 * math.pi else math.inf
            x, x_far = math.log1p(kappa * x) / kappa, math.log1p(kappa * x_far / stretch) / kappa
        local = radius / stretch
        bend, r = kappa * local, local * scale
        if not (0.0 < radius < min(end, side) and abs(bend) < 0.9 and r < 3.0):
            return None
        reach = r
        if bend:
            reach *= -math.log1p(-abs(bend)) / abs(bend)
            rates.append((0.0, -2.0 * math.log(abs(bend))))
        rates += _rates(0.0, answer, min(math.hypot(end, side) / radius, math.pi / r))
        if self._odd:
            rates += _rates(self._log_odd, answer, min(end, side) / radius)
        at = scale * x, scale * x_far, scale * y, scale * y_far
        s, s_far, p, p_far = at if self._turn == 1.0 else at[2:] + at[:2]
        return _Place(x, y, s, s_far, p, p_far, r, reach, ka)

    def _gap(self, one: _Place, other: _Place, here: float, there: float, rates: list[tuple[float, float]]) -> None:
        """Add to the `_rates` what two discs with these answers do to each other; a rate of 0 where they overlap."""
        kappa = self._sheet.curvature
        w = complex(other.x - one.x, other.y - one.y)
        if kappa != 0.0:
            turn = kappa * w.imag
            if abs(turn) > 0.9 * math.pi:
                return
            grown, sine = math.expm1(kappa * w.real), math.sin(0.5 * turn)
            w = complex(grown - 2.0 * (grown + 1.0) * sine * sine, (grown + 1.0) * math.sin(turn)) / kappa
        # From the flat sheet's lengths at the first disc to the strip's there.
        a, b = one.radius, other.radius * math.exp(kappa * (other.x - one.x))
        apart = abs(w) * self._scale
        if not apart > a + b:
            rates.append((0.0, 0.0))
            return
        rates += [(here, 2.0 * math.log(apart / a)), (there, 2.0 * math.log(apart / b))]
        rates.append((2.0 * (here + there), math.acosh((apart * apart - a * a - b * b) / (2.0 * a * b))))

    def solve(self, discs: Sequence[tuple[float, float, float, float]]) -> Coupling | None:
        """Solve one scene.

        Args:
            discs: u [m], phi [rad], radius [m] and conductance [S/m^2] of each.

        Returns:
            the coupling, or None where `multipole` has to do it or to refuse it.
        """
        places: list[_Place] = []
        answers: list[float] = []
        rates: list[tuple[float, float]] = []
        for u, phi, radius, conductance in discs:
            if not (radius > 0.0 and conductance >= 0.0):
                return None
            ka = math.sqrt(conductance * self._total) * radius
            most = min(ka, 1e6)
            answer = 2.0 * math.log(most / (_TYPICAL_ORDER + math.hypot(_TYPICAL_ORDER, most))) if ka else -math.inf
            place = self._place(u, phi, radius, ka, answer, rates)
            if place is None:
                return None
            answers.append(answer)
            places.append(place)
        corners, gaps, ends, edges, pairs, signs = [], [], [], [], [], []
        points, inverse, logs, slopes, itself = [], [], [], [], []
        least, image, loss, linear = math.inf, math.inf, 1.0, math.pi * self._linear
        for i, one in enumerate(places):
            for j, other in enumerate(places[: i + 1]):
                p, p_far = one.p + other.p, one.p_far + other.p_far
                apart, both = one.p - other.p, p if p <= p_far else -p_far
                flipped = one.s + other.s > one.s_far + other.s_far
                s, other_s = (one.s_far, other.s_far) if flipped else (one.s, other.s)
                far, first, second = one.s if flipped else one.s_far, i, j
                if s < other_s:
                    far, first, second = other.s if flipped else other.s_far, j, i
                    s, other_s, apart = other_s, s, -apart
                sign, reach = -1.0 if flipped else 1.0, one.reach + other.reach
                if flipped == (self._turn == 1.0):
                    apart, both = -apart, -both
                constant, slope = 2.0 * linear * other_s * far, linear * (far - other_s) + 0j
                if i == j:
                    constant -= math.log(one.radius)
                    slope += sign * self._bend
                else:
                    self._gap(one, other, answers[i], answers[j], rates)
                corners.append((s + other_s, -both, reach, constant, slope))
                gaps.append((s - other_s, -apart, reach, 0.0, linear * (far + other_s)))
                if self._odd:
                    ends.append((s + other_s, apart, reach, 0.0, 0.0))
                    edges.append((s - other_s, both, reach, 0.0, 0.0))
                pairs.append((first, second))
                signs.append(sign)
                image = min(image, 2.0 * self._sigma - s - other_s - reach)
        for distance, around, reach, constant, slope in corners + gaps + ends + edges:
            points.append(complex(distance, around))
            slopes.append(slope)
            alone = distance == 0.0 == around
            itself.append(float(alone))
            if alone or distance > _FAR_DISTANCE:
                inverse.append(0j)
                logs.append(constant)
                continue
            grown, sine = math.expm1(distance), math.sin(0.5 * around)
            z = complex(grown - 2.0 * (grown + 1.0) * sine * sine, (grown + 1.0) * math.sin(around))
            size = abs(z)
            inverse.append(1.0 / z)
            logs.append(math.log(size) - distance + constant)
            least, loss = min(least, size), max(loss, reach / math.log1p(size))
        tolerance, rate = self._tolerance, min([rate for _, rate in rates])
        if rate < _MIN_RATE or image < _MIN_IMAGE * self._sigma:
            return None
        waves = 2 * math.ceil(self._digits / image)
        beyond = math.log(tolerance / _FIRST_SIZE)
        order = math.ceil(max([1.0, *((part - beyond) / each for part, each in rates)]))
        arguments = np.array([logs, slopes, itself, inverse, points])
        while order <= _MAX_ORDER:
            rounding = _ROUNDING_ERROR * loss ** (2 * order) + 10.0 * math.exp(-(waves // 2 + 1) * image)
            if rounding > 0.1 * tolerance or least ** (2 * order) < 1e-250:
                return None
            # A scene's symmetry may hide the last orders, so the error is never less than what was expected.
            least_error = max(rounding, _FIRST_SIZE * math.exp(max([part - each * order for part, each in rates])))
            coupling = self._of_scene(order, places, pairs, signs, arguments, waves, math.exp(-rate), least_error)
            error = float(coupling.error[0])
            if error <= tolerance:
                return coupling
            if not error < 1.0:
                return None
            order += math.ceil(math.log(error / tolerance) / max(rate, 1.0)) or 1
        return None

    def _of_scene(
        self,
        order: int,
        places: Sequence[_Place],
        pairs: Sequence[tuple[int, int]],
        signs: list[float],
        points: Complex,
        waves: int,
        decay: float,
        least_error: float,
    ) -> Coupling:
        """Solve it at one order; the error is not a number where the matrix is not positive."""
        k, count, (length, breadth) = len(places), len(pairs), self._sides
        tables = self._tables.get((order, k))
        if tables is None:
            tables = self._tables[order, k] = self._of_order(order, k)
        powers = 2 * order + 3
        parts = np.empty((powers + waves, points.shape[1]), dtype=np.complex128)
        parts[:3], parts[3:powers] = points[:3], points[3]
        np.multiply.accumulate(parts[3:powers], 0, out=parts[3:powers])
        np.exp(self._waves[:waves, None] * points[4], out=parts[powers:])
        series = tables.series[:, : powers + waves].dot(parts)
        if -1.0 in signs:
            odd = series[1::2]
            np.multiply(odd, signs * (points.shape[1] // count) if 1.0 in signs else -1.0, out=odd)
        if tables.dense is None:
            mixed = np.matmul(tables.mix, series.reshape(2 * order + 1, -1, count))
            mixed[2, 2:] += tables.linear
            mixed = mixed.reshape(2 * order + 1, 2, -1).swapaxes(0, 1).reshape(4 * order + 2, -1)
            found = tables.spread.dot(mixed.view(np.float64)).view(np.complex128)
            blocks = found.reshape(order + 1, order + 1, 2, count).swapaxes(1, 2)
        else:
            blocks = tables.dense.dot(series.reshape(-1, count)).reshape(order + 1, 2, order + 1, count)
            blocks += tables.linear
        # Two neighbours of a row are one complex number, of the real parts' unknown and of the imaginary parts'.
        grid = tables.grid.copy()
        matrix, step = grid.view(np.float64), 2 * k
        first, size = order * step, (order + 1) * step
        placed = grid[:size, : size // 2].reshape(order + 1, k, 2, order + 1, k)
        for n, (one, other) in enumerate(pairs):
            placed[:, one, :, :, other] = blocks[..., n]
            if one != other:
                reals = matrix[:size, :size].reshape(order + 1, k, 2, order + 1, k, 2)
                reals[:, other, :, :, one] = reals[:, one, :, :, other].transpose(2, 3, 0, 1)
        scale, answers = [1.0] * (size + 2), []
        for i, (_, _, _, _, _, _, radius, _, ka) in enumerate(places):
            power, ratios = 1.0, _ratios(ka, order + 1)
            answers.append(1.0 / (2.0 * math.pi * ka * ratios[0]) if ka * ratios[0] > 0.0 else math.inf)
            for m in range(order):
                power *= radius
                row = m * step + 2 * i
                scale[row] = scale[row + 1] = power * math.sqrt(2.0 * math.pi * (m + 1) * ratios[m] * ratios[m + 1])
        scales = np.array(scale)
        matrix *= scales
        matrix *= scales[:, None]
        charges = matrix[first:size:2, first:size:2].tolist()
        for i, answer in enumerate(answers):
            charges[i][i] += answer
        diagonal = matrix.reshape(-1)[:: size + 3]
        diagonal += tables.lift
        factor, failed = self._factorise(matrix.T, clean=0, overwrite_a=1)  # the lower triangle of rows
        if failed:
            return Coupling(*np.full((7, 1), math.nan))
        solved = factor.T.take(tables.kept, 0)
        x, y = [place.x / length for place in places], [place.y / breadth for place in places]
        totals = []
        for end in first, first - step, max(first - 2 * step, 0):  # of this order, and of one and two less
            part = solved[:, :end]
            totals.append(_totals(part.dot(part.T).tolist(), charges, x, y))
        last, one_less, two_less = totals
        change = _solution_change(last, one_less, self._units)
        earlier = _solution_change(one_less, two_less, self._units)
        ratio = min(max(decay, change / earlier if change < earlier else decay), 0.9)
        safety = _SAFETY_FACTOR if order > 1 else 2.0 * _SAFETY_FACTOR
        rest = safety * max(change, 0.1 * earlier * decay) * ratio / (1.0 - ratio)
        g, x_mean, y_mean, xx, xy, yy = last
        numbers = g / self._total, x_mean, y_mean, xx / self._total, xy / self._total, yy / self._total
        return Coupling(*np.array([*numbers, max(rest, least_error)]).reshape(7, 1))


def _solution_change(one: tuple[float, ...], other: tuple[float, ...], units: tuple[float, ...]) -> float:
    """Return how far apart the six numbers of two solutions are, as `Coupling.error` counts it.

    Args:
        one: as of `Coupling`.
        other: another solution.
        units: what makes xx, xy and yy numbers: the resistances of the bare sheets along, their mean, around [ohm].
    """
    g, x, y, xx, xy, yy = one
    g2, x2, y2, xx2, xy2, yy2 = other
    relative = abs(g - g2) / g if g > 0.0 else 0.0
    along, diagonal, around = units
    tensor = max(abs(xx - xx2) * along, abs(xy - xy2) * diagonal, abs(yy - yy2) * around)
    return max(relative, abs(x - x2), abs(y - y2), tensor)


def _rates(strength: float, answer: float, room: float) -> list[tuple[float, float]]:
    """Return what an image adds to the error of order M as (ln size, rate) of size exp(-rate M), at most about that.

    The image's charge acts from twice the `room` (in radii), once; its images of images act from ever nearer by, and
    weaker each time.

    Args:
        strength: of the image, its logarithm.
        answer: of the disc to a multipole of middling order, its logarithm.
        room: from the centre to the mirror.
    """
    once = 2.0 * strength + answer
    return [
        (once, 2.0 * math.log(2.0 * room)),
        (once + _REFLECTION_POWER * (strength + answer), 2.0 * math.acosh(room)),
    ]


def _ratios(x: float, order: int) -> Sequence[float]:
    """Compute `bessel_ratios` of one number."""
    if x > 100.0:
        return [1.0] * order if math.isinf(x) else bessel_ratios(x, order).tolist()
    start = order + 4 + math.isqrt(int(25.0 * x))
    rho = x / (start - 0.5 + math.hypot(start + 0.5, x))
    found = [0.0] * order
    for m in range(start - 1, order, -1):
        rho = x / (2.0 * m + x * rho)
    for m in range(order, 0, -1):
        rho = found[m - 1] = x / (2.0 * m + x * rho)
    return found


def _totals(
    gram: list[list[float]], charges: list[list[float]], x: list[float], y: list[float]
) -> tuple[float, float, float, float, float, float]:
    """Eliminate the discs' total currents; return G, X, Y and the rest in units of Ru + Rl.

    Args:
        gram: of what the higher moments answer: to the charge of each disc, to x, to y.
        charges: what one total current does to another's disc.
        x: centres of the discs along the slant, as a fraction.
        y: the same, around.
    """
    k = len(x)
    if k == 1:
        (charge, along, around), (_, xx, xy), (_, _, yy) = gram
        pivot = charges[0][0] - charge
        return 1.0 / pivot, x[0] - along, y[0] - around, xx, xy, yy
    x0, y0 = sum(x) / k, sum(y) / k
    g = gx = gy = 0.0
    xx, xy, yy = gram[k][k], gram[k][k + 1], gram[k + 1][k + 1]
    done: list[tuple[list[float], float, float, float]] = []
    for i in range(k):
        less = gram[i]
        row = [c - a for c, a in zip(charges[i], less, strict=False)]
        one, along, around = 1.0, x[i] - x0 - less[k], y[i] - y0 - less[k + 1]
        for j, (above, one2, along2, around2) in enumerate(done):
            factor = row[j] / above[j]
            for n in range(j + 1, i + 1):
                row[n] -= factor * (done[n][0][j] if n < i else row[j])
            one -= factor * one2
            along -= factor * along2
            around -= factor * around2
        done.append((row, one, along, around))
        to_one, to_along = one / row[i], along / row[i]
        g += one * to_one
        gx += along * to_one
        gy += around * to_one
        xx += along * to_along
        xy += around * to_along
        yy += around * around / row[i]
    if g <= 0.0:
        return 0.0, x0, y0, xx, xy, yy
    dx, dy = gx / g, gy / g
    return g, x0 + dx, y0 + dy, xx - gx * dx, xy - gx * dy, yy - gy * dy
