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
from functools import cache, lru_cache
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
def _log_series(order: int) -> tuple[Complex, Floats]:
    """Return f_0..f_n of L = log(1 - exp(-z)) by L and powers of 1/(exp(z) - 1), and of log(sinh(t/2) / (t/2)) at 0."""
    near = np.zeros((order + 1, order + 1), dtype=np.complex128)
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
    """What an order M of one model needs, whatever the contacts are; series are f_0..f_2M, Fourier coefficient 0 last.

    Attributes:
        turns: by the strip's direction (1, -1, i or -i times x + i y): T without r^m, and H of a disc on itself.
        index: j + k.
        kernel: what the series at w + w', w + w'*, w - w'* and w - w' are multiplied by in H, shape (4, M+1, M+1).
        linear: H from offset to offset, the same for w' and w'*.
        near: series by the logarithm, and by powers of 1/(exp(z) - 1).
        images: series by exp(n z), n of the `_waves`.
        slopes: of offset along and, times i, around [sides of the sheet], (-1)^(m-1) / m, shape (2, M).
    """

    turns: dict[Any, tuple[Complex, Complex]]  # complex, which mypyc does not find here
    index: Any
    kernel: Complex
    linear: Complex
    near: Complex
    images: Complex
    slopes: Complex


class _Place(NamedTuple):
    """A disc in the strip [(shorter side)/pi]: distances from ends and edges, r, and the largest |delta|."""

    x: float
    y: float
    s: float
    s_far: float
    p: float
    p_far: float
    radius: float
    reach: float


class _Pair(NamedTuple):
    """Two discs, or one and itself, seen from the nearer end; the first lies at least as far from it as the second."""

    first: int
    second: int
    turn: Any
    high_far: float
    low: float
    constant: float


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
        aspect = sheet.length / sheet.breadth
        self._units = tuple(r / self._total for r in (upper * aspect, math.sqrt(upper * lower), lower / aspect))
        self._digits = math.log(1.0 / (_MIN_TERM * self._tolerance))
        count = math.ceil(self._digits / (_MIN_IMAGE * self._sigma))
        self._waves = np.arange(1.0, count + 1.0).repeat(2) * np.tile((1.0 + 0j, -1.0), count)
        self._tables: dict[int, _Tables] = {}
        self._factorise: Any = None  # with the first table: a guard that solves nothing does not wait for scipy

    def _of_order(self, order: int) -> _Tables:
        from scipy.linalg.lapack import dpotrf

        self._factorise = dpotrf
        rim, binomials = _rim_powers(order)
        near, own = _log_series(2 * order)
        j, n = np.arange(order + 1), np.arange(2 * order + 1)
        size = np.abs(self._waves)[:, None]
        factorials = np.array([float(math.factorial(m)) for m in n.tolist()])
        images = -(self._waves.real[:, None] ** n) / (
            size * np.expm1(np.minimum(2.0 * self._sigma * size, 600.0)) * factorials
        )
        signed = binomials * (-1.0) ** j
        kernel = np.array([binomials, -self._odd * binomials, self._odd * signed, -signed]) / (2.0 * math.pi)
        linear = np.zeros_like(binomials)
        linear[1, 1] = -0.5 * self._linear
        index, turns = j[:, None] + j, {}
        # b is everywhere the same multiple of r, so b^(m-j) r^j is a power of it times r^m
        rim = rim * (self._sheet.curvature / self._scale) ** np.maximum(np.array([*j[1:], 0.0]) - j[:, None], 0.0)
        for turn in (self._turn, -self._turn):
            eta = self._sheet.curvature / (self._scale * turn)
            series = own * (1.0 - eta**n) + images.sum(axis=0)
            series[1] = -0.5
            itself = kernel[3] * series[index] + linear
            itself[0, 1] += eta / (4.0 * math.pi)
            itself[1, 0] += eta / (4.0 * math.pi)
            turns[turn] = rim * turn ** j[:, None], itself
        # Complex, what meets complex numbers: numpy takes as long to convert a small array as to multiply it.
        slopes = rim[1, :-1] / self._scale * np.array([[1.0 / self._sides[0]], [1j / self._sides[1]]])
        return _Tables(turns, index, *(a.astype(np.complex128) for a in (kernel, linear, near, images, slopes)))

    def _place(
        self, u: float, phi: float, radius: float, answer: float, rates: list[tuple[float, float]]
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
            rates.append((1.0, -2.0 * math.log(abs(bend))))
        rates += _rates(1.0, answer, min(math.hypot(end, side) / radius, math.pi / r))
        if self._odd:
            rates += _rates(abs(self._odd), answer, min(end, side) / radius)
        at = scale * x, scale * x_far, scale * y, scale * y_far
        s, s_far, p, p_far = at if self._turn == 1.0 else at[2:] + at[:2]
        return _Place(x, y, s, s_far, p, p_far, r, reach)

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
            rates.append((1.0, 0.0))
            return
        rates += [(here, 2.0 * math.log(apart / a)), (there, 2.0 * math.log(apart / b))]
        rates.append(((here * there) ** 2, math.acosh((apart * apart - a * a - b * b) / (2.0 * a * b))))

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
            answer = 1.0 if ka > 1e6 else (ka / (_TYPICAL_ORDER + math.hypot(_TYPICAL_ORDER, ka))) ** 2
            place = self._place(u, phi, radius, answer, rates)
            if place is None:
                return None
            answers.append(answer)
            places.append(place)
        pairs, corners, ends, edges, gaps, points, inverse, logs = [], [], [], [], [], [], [], []
        least, image, loss = math.inf, math.inf, 1.0
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
                turn = -self._turn if flipped else self._turn
                if turn.real < 0.0 or turn.imag < 0.0:
                    apart, both = -apart, -both
                constant = self._linear * other_s * far
                reach = one.reach + other.reach
                corners.append((s + other_s, both, reach))
                if i == j:
                    constant -= math.log(one.radius) / (2.0 * math.pi)
                else:
                    gaps.append((s - other_s, apart, reach))
                    self._gap(one, other, answers[i], answers[j], rates)
                pairs.append(_Pair(first, second, turn, far, other_s, constant))
                if self._odd:
                    ends.append((s + other_s, apart, reach))
                    edges.append((s - other_s, both, reach))
                image = min(image, 2.0 * self._sigma - s - other_s - reach)
        for distance, around, reach in corners + ends + edges + gaps:
            points.append(complex(distance, around))
            if distance > _FAR_DISTANCE:
                inverse.append(0j)
                logs.append(0.0)
                continue
            grown, sine = math.expm1(distance), math.sin(0.5 * around)
            z = complex(grown - 2.0 * (grown + 1.0) * sine * sine, (grown + 1.0) * math.sin(around))
            size = abs(z)
            inverse.append(1.0 / z)
            logs.append(math.log(size) - distance)
            least, loss = min(least, size), max(loss, reach / math.log1p(size))
        tolerance, rate = self._tolerance, min([rate for _, rate in rates])
        if rate < _MIN_RATE or image < _MIN_IMAGE * self._sigma:
            return None
        waves = 2 * math.ceil(self._digits / image)
        order = math.ceil(max(math.log(max(_FIRST_SIZE * part / tolerance, 1.0)) / each for part, each in rates)) or 1
        arguments = np.array(points), np.array(inverse), np.array(logs), waves
        while order <= _MAX_ORDER:
            rounding = _ROUNDING_ERROR * loss ** (2 * order) + 10.0 * math.exp(-(waves // 2 + 1) * image)
            if rounding > 0.1 * tolerance or least ** (2 * order) < 1e-250:
                return None
            # A scene's symmetry may hide the last orders, so the error is never less than what was expected.
            least_error = max(rounding, *(_FIRST_SIZE * part * math.exp(-each * order) for part, each in rates))
            coupling = self._of_scene(order, discs, places, pairs, arguments, math.exp(-rate), least_error)
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
        discs: Sequence[tuple[float, float, float, float]],
        places: Sequence[_Place],
        pairs: Sequence[_Pair],
        arguments: tuple[Complex, Complex, Floats, int],
        decay: float,
        least_error: float,
    ) -> Coupling:
        """Solve it at one order; the error is not a number where the matrix is not positive."""
        tables = self._tables.get(order)
        if tables is None:
            tables = self._tables[order] = self._of_order(order)
        turns, index, kernel, linear, near, images, slopes = tables
        points, inverse, logs, waves = arguments
        powers_of = np.empty((len(logs), 2 * order + 1), dtype=np.complex128)
        powers_of[:, 0], powers_of[:, 1:] = logs, inverse[:, None]
        np.multiply.accumulate(powers_of[:, 1:], 1, out=powers_of[:, 1:])
        series = powers_of.dot(near)
        series += np.exp(points[:, None] * self._waves[:waves]).dot(images[:waves])
        k, (length, breadth) = len(places), self._sides
        terms, count = series.take(index, 1), len(pairs)
        same = terms[:count] * kernel[0]
        mirrored = linear
        if self._odd:
            two = terms[count : 3 * count].reshape(2, count, order + 1, order + 1) * kernel[1:3, None]
            mirrored = two[0] + two[1]
            mirrored += linear
        step = 2 * k
        first = order * step  # row of the first charge
        size = first + step
        # Two neighbours of a row are one complex number, of the real parts' unknown and of the imaginary parts'.
        grid = np.zeros((size + 2, size // 2 + 1), dtype=np.complex128)
        blocks = grid[:size, : size // 2].reshape(order + 1, k, 2, order + 1, k)
        matrix = grid.view(np.float64)
        reals = matrix[:size, :size].reshape(order + 1, k, 2, order + 1, k, 2)
        rims, answers = [], []
        for i, (place, disc) in enumerate(zip(places, discs, strict=True)):
            ka = math.sqrt(disc[3] * self._total) * disc[2]
            ratios = _ratios(ka, order + 1)
            answers.append(1.0 / (2.0 * math.pi * ka * ratios[0]) if ka * ratios[0] > 0.0 else math.inf)
            rim = []
            for m in range(order):
                rim.append(place.radius ** (m + 1) * math.sqrt(2.0 * math.pi * (m + 1) * ratios[m] * ratios[m + 1]))
            rims.append(np.array([*rim, 1.0], dtype=np.complex128))
            grid[size:, i : first // 2 : k] = slopes * rims[i][:-1]
        apart = iter(terms[len(terms) - count + k :] * kernel[3] if k > 1 else ())
        for n, (one, other, turn, high_far, low, constant) in enumerate(pairs):
            to_offset, itself = turns[turn]
            here = there = to_offset * rims[one]
            if one == other:
                straight = same[n] + itself
            else:
                straight = same[n] + next(apart) + linear
                there = to_offset * rims[other]
            straight[0, 0] += constant
            straight[1, 0] -= self._linear * low
            straight[0, 1] += self._linear * high_far
            across = here.T
            straight = across.dot(straight).dot(there)
            crossed = across.dot(mirrored[n] if self._odd else linear).dot(there.conj())
            turned = straight.conj()
            blocks[:, one, 0, :, other] = crossed + turned
            blocks[:, one, 1, :, other] = 1j * (crossed - turned)
            if one != other:
                reals[:, other, :, :, one] = reals[:, one, :, :, other].transpose(2, 3, 0, 1)
        charges = matrix[first:size:2, first:size:2].tolist()
        for i, answer in enumerate(answers):
            charges[i][i] += answer
        diagonal = matrix.reshape(-1)[:: size + 3]
        diagonal[:first] += 1.0
        diagonal[first:] = 1e30  # only what is left of it is read
        factor, failed = self._factorise(matrix.T, clean=0, overwrite_a=1)  # the lower triangle of rows
        if failed:
            return Coupling(*np.full((7, 1), math.nan))
        solved = factor.T[first:, :first]
        x, y = [place.x / length for place in places], [place.y / breadth for place in places]
        totals = []
        for end in first, first - step, max(first - 2 * step, 0):  # of this order, and of one and two less
            part = solved[:, :end]
            totals.append(_totals(part.dot(part.T).tolist(), charges, x, y))
        found, one_less, two_less = totals
        change = _solution_change(found, one_less, self._units)
        earlier = _solution_change(one_less, two_less, self._units)
        ratio = min(max(decay, change / earlier if change < earlier else decay), 0.9)
        rest = (
            (_SAFETY_FACTOR if order > 1 else 2.0 * _SAFETY_FACTOR)
            * max(change, 0.1 * earlier * decay)
            * ratio
            / (1.0 - ratio)
        )
        g, x_mean, y_mean, xx, xy, yy = found
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


@lru_cache(maxsize=64)
def scene_solver(sheet: SectorSheet, upper_resistance: float, lower_resistance: float, tolerance: float) -> SceneSolver:
    """Return the solver of scenes on these sheets; equal ones share it. Arguments as of `FieldModel`."""
    return SceneSolver(sheet, upper_resistance, lower_resistance, tolerance)


def _rates(strength: float, answer: float, room: float) -> list[tuple[float, float]]:
    """Return what an image adds to the error of order M as (size, rate) of size exp(-rate M), at most about that.

    The image's charge acts from twice the `room` (in radii), once; its images of images act from ever nearer by, and
    weaker each time.

    Args:
        strength: of the image.
        answer: of the disc to a multipole of middling order.
        room: from the centre to the mirror.
    """
    once = strength**2 * answer
    return [
        (once, 2.0 * math.log(2.0 * room)),
        (once * (strength * answer) ** _REFLECTION_POWER, 2.0 * math.acosh(room)),
    ]


def _ratios(x: float, order: int) -> Sequence[float]:
    """Compute `bessel_ratios` of one number."""
    if x > 100.0:
        return [1.0] * order if math.isinf(x) else bessel_ratios(x, order).tolist()
    start = order + 7 + math.isqrt(int(40.0 * x))
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
        gram: of what the higher moments answer: to the charge of each disc (every second row), to x, to y.
        charges: what one total current does to another's disc.
        x: centres of the discs along the slant, as a fraction.
        y: the same, around.
    """
    k = len(x)
    if k == 1:
        pivot = charges[0][0] - gram[0][0]
        return 1.0 / pivot, x[0] - gram[0][2], y[0] - gram[0][3], gram[2][2], gram[2][3], gram[3][3]
    x0, y0 = sum(x) / k, sum(y) / k
    rows = []
    for i, row in enumerate(charges):
        less = gram[2 * i]
        rows.append([c - a for c, a in zip(row, less[: 2 * k : 2], strict=True)])
        rows[i] += 1.0, x[i] - x0 - less[-2], y[i] - y0 - less[-1]
    g = gx = gy = 0.0
    xx, xy, yy = gram[-2][-2], gram[-2][-1], gram[-1][-1]
    for i, row in enumerate(rows):
        pivot = row[i]
        for below in rows[i + 1 :]:
            factor = below[i] / pivot
            for j in range(i + 1, k + 3):
                below[j] -= factor * row[j]
        one, along, around = row[k:]
        g += one * one / pivot
        gx += one * along / pivot
        gy += one * around / pivot
        xx += along * along / pivot
        xy += along * around / pivot
        yy += around * around / pivot
    if g <= 0.0:
        return 0.0, x0, y0, xx, xy, yy
    dx, dy = gx / g, gy / g
    return g, x0 + dx, y0 + dy, xx - gx * dx, xy - gx * dy, yy - gy * dy
