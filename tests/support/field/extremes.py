"""Extreme sensors: the field solver against 60 digits, and naive formulas beside it.

Each case gives the worst error of the four guide potentials relative to the supply, relative errors of the contact's
conductance and of its polarisability, the condition of the scaled system, and what the textbook's way makes of the same
case: the Green function without expm1 (nor closed-form images, so that its aliasing, 1e-9 to 1e-2, shows as well), and
the guides from the 4 x 4 matrix Y instead of the structured elimination.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np

from coneskin.skin.field.circles import PHASE
from coneskin.skin.field.disc import Discs
from coneskin.skin.field.fourport import angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import solve_discs
from coneskin.skin.field.sheet import SectorSheet

from . import exact_solution

ORDER = 3  # highest multipole, here and in the exact solution
POINTS = 8  # on the rim of the disc, likewise


@dataclass(frozen=True, slots=True)
class ExtremeCase:
    """One extreme sensor with one disc."""

    name: str
    sheet: SectorSheet
    lower: float
    u: float
    phi: float
    radius: float
    g: float


@dataclass(frozen=True, slots=True)
class RoundingErrors:
    """Errors of one case."""

    volts: float
    conductance: float
    excess: float
    condition: float
    naive_green: float
    naive_y: float


def extreme_cases() -> Iterator[ExtremeCase]:
    """Yield the sweep: one extreme at a time, then several."""

    def at(
        name: str,
        sheet: SectorSheet,
        lower: float = 1.0,
        size: float = 0.3,
        ka: float = 3.0,
        x: float = 0.4,
        y: float = 0.3,
    ) -> ExtremeCase:
        u, phi = x * sheet.width, y * sheet.wrap
        radius = size * float(sheet.edge_distances(u, phi).min())
        return ExtremeCase(name, sheet, lower, u, phi, radius, (ka / radius) ** 2 / (1.0 + lower))

    paper = SectorSheet.of_sector(0.1, 0.1, math.pi / 2)
    for ka in (1e-8, 1e-4, 1.0, 1e2, 1e4, 1e8, math.inf):
        yield at(f"ka = {ka:g}", paper, 2.0, ka=ka)
    for lower in (1e-4, 1e-2, 1e2, 1e4):
        yield at(f"Rl/Ru = {lower:g}", paper, lower)
    for ratio in (1e-6, 1e-3, 1e3, 1e6, 1e9):
        angle = min(1.5, 3.0 / ratio) if ratio > 1 else 1.5
        yield at(f"r1/W = {ratio:g}", SectorSheet.of_sector(ratio * 0.1, 0.1, angle), 2.0)
    yield at("cylinder", SectorSheet(0.1, 0.0, 0.15, 2.0), 2.0)
    yield at("narrowing to r2/r1 = 1e-6", SectorSheet(0.1, -10.0 * (1 - 1e-6), 0.15, 2.0), 2.0)
    for angle in (1e-3, 0.1, math.pi, 2 * math.pi):
        yield at(f"theta0 = {angle:.4g}", SectorSheet.of_sector(0.1, 0.1, angle), 2.0)
    for aspect in (1e3, 1e6, 1e9):
        yield at(f"length/breadth = {aspect:g}", SectorSheet(0.1, 0.0, 0.1 / aspect, 2.0), 2.0)
        yield at(f"breadth/length = {aspect:g}", SectorSheet(0.1, 0.0, 0.1 * aspect, 2.0), 2.0)
    for size in (1e-3, 1e-6, 1e-9):
        yield at(f"a/room = {size:g}", paper, 2.0, size=size)
    for gap in (1e-3, 1e-6, 1e-12):
        yield at(f"a/room = 1 - {gap:g}", paper, 2.0, size=1.0 - gap, x=0.1)
        yield at(f"corner, {gap:g} W away", paper, 2.0, size=0.5, x=gap, y=gap)
    weak = at("", SectorSheet.of_sector(1e-7, 0.1, 6.0), 1e4, size=0.9, ka=1e-6, x=1e-5, y=0.9)
    yield ExtremeCase("all at once, weak", weak.sheet, weak.lower, weak.u, weak.phi, weak.radius, weak.g)
    hard = at("", SectorSheet.of_sector(1e8, 0.1, 1e-8), 1e-4, size=0.99, ka=math.inf, x=1e-3, y=0.99)
    yield ExtremeCase("all at once, bonded", hard.sheet, hard.lower, hard.u, hard.phi, hard.radius, hard.g)


def measure(case: ExtremeCase) -> RoundingErrors:
    """Solve a case three ways and compare."""
    exact = exact_solution.solve_exactly(
        case.sheet, 1.0, case.lower, case.u, case.phi, case.radius, case.g, order=ORDER, points=POINTS
    )
    model = FieldModel(case.sheet, 1.0, case.lower)
    one = Discs(*(np.array([[v]]) for v in (case.u, case.phi, case.radius, case.g)))
    coupling, _ = solve_discs(case.sheet, 1.0, case.lower, one, ORDER, POINTS)
    radial, angular = model.read(coupling, radial_phase()), model.read(coupling, angular_phase())
    volts = (*radial.electrodes[0, 2:], *angular.electrodes[0, :2])

    def worst(got: Sequence[float]) -> float:
        return max(abs(float(mp.mpf(float(v)) - e)) for v, e in zip(got, exact.volts, strict=True))

    def relative(got: float, want: mp.mpf) -> float:
        return abs(float((mp.mpf(float(got)) - want) / want)) if want else abs(float(got))

    return RoundingErrors(
        volts=worst(volts),
        conductance=relative(coupling.conductance[0], exact.conductance),
        excess=max(relative(coupling.xx[0], exact.xx), relative(coupling.yy[0], exact.yy)),
        condition=float(exact.condition),
        naive_green=worst(_naive_green(case)),
        naive_y=worst(_from_y(model.admittance(coupling)[0])),
    )


def _from_y(y: np.ndarray) -> list[float]:
    """Return the guides of both phases by eliminating in Y."""
    out: list[float] = []
    for guides, driven in (((2, 3), 1), ((0, 1), 2)):
        try:
            out += list(np.linalg.solve(y[np.ix_(guides, guides)], -y[list(guides), driven]))
        except np.linalg.LinAlgError:
            out += [math.nan, math.nan]
    return [v if math.isfinite(v) else 1e300 for v in out]


def _naive_green(case: ExtremeCase) -> list[float]:
    """Solve the same truncation from ln|z| of absolute coordinates: images summed, no expm1, full system."""
    sheet, order, points = case.sheet, ORDER, POINTS
    with np.errstate(all="ignore"):
        k0 = sheet.curvature
        r1 = 1.0 / k0 if k0 else math.inf
        zeta = np.exp(2j * math.pi * (np.arange(points) + PHASE) / points)
        length = math.log((r1 + sheet.width) / r1) * r1 if k0 else sheet.width
        breadth = sheet.arc
        xc = math.log((r1 + case.u) / r1) * r1 if k0 else case.u
        yc = breadth * case.phi / sheet.wrap
        z = (r1 + case.u + case.radius * zeta) if k0 else case.u + case.radius * zeta
        w = np.log(z / r1) * r1 if k0 else z
        full = w.real + 1j * (yc + w.imag)
        along_x = breadth <= length
        scale = math.pi / min(length, breadth)
        sigma = scale * max(length, breadth)
        omega = scale * (full if along_x else full.imag + 1j * full.real)
        ra, rb = (case.lower, 1.0) if along_x else (1.0, case.lower)
        rs = ra + rb

        def f(beta: Any, alpha: Any) -> Any:
            e = np.exp(-beta)
            return 1.0 - 2.0 * e * np.cos(alpha) + e * e

        s, p = omega.real, omega.imag
        ds, ss = np.abs(s[:, None] - s[None, :]), s[:, None] + s[None, :]
        minus, plus = p[:, None] - p[None, :], p[:, None] + p[None, :]
        f1, f3, f2, f4 = f(ds, minus), f(ds, plus), f(ss, minus), f(ss, plus)
        chord = np.abs(zeta[:, None] - zeta[None, :]) ** 2
        np.fill_diagonal(chord, 1.0)
        f1 = f1 / chord
        np.fill_diagonal(f1, (scale * case.radius * (r1 / np.abs(z) if k0 else 1.0)) ** 2)
        for n in range(0, 9):
            for beta, with_minus, with_plus in (
                (2 * n * sigma + ds, f1, f3) if n else (None, None, None),
                (2 * n * sigma - ds, f1, f3) if n else (None, None, None),
                (2 * n * sigma + ss, f2, f4) if n else (None, None, None),
                (2 * (n + 1) * sigma - ss, f2, f4),
            ):
                if beta is not None:
                    with_minus *= f(beta, minus)
                    with_plus *= f(beta, plus)
        low, high = np.minimum(s[:, None], s[None, :]), np.maximum(s[:, None], s[None, :])
        green = -((ra + rb) * np.log(f1 / f4) + (ra - rb) * np.log(f2 / f3)) / (4 * math.pi)
        green += rb / math.pi * low * (sigma - high) / sigma
        m = np.arange(1, order + 1)[:, None]
        fourier = np.empty((2 * order + 1, points))
        fourier[0] = 1.0 / points
        angle = np.angle(zeta)
        fourier[1::2], fourier[2::2] = np.cos(m * angle) * 2 / points, np.sin(m * angle) * 2 / points
        matrix = fourier @ green @ fourier.T
        from scipy import special

        ka = case.radius * math.sqrt(rs * case.g)
        orders = np.arange(order + 2)
        bessel = special.iv(orders, ka) if ka < math.inf else np.ones(order + 2)
        d0 = rs / (2 * math.pi) * bessel[0] / (ka * bessel[1])
        dm = rs / (2 * math.pi * m[:, 0]) * bessel[:-2] / bessel[2:]
        matrix = matrix + np.diag(np.concatenate([[d0], np.repeat(dm, 2)]))
        columns = np.zeros((2 * order + 1, 3))
        columns[0] = 1.0, xc / length, yc / breadth
        series = (
            (case.radius / (1.0 + k0 * case.u)) * (-k0 * case.radius / (1.0 + k0 * case.u)) ** (m[:, 0] - 1) / m[:, 0]
        )
        columns[1::2, 1], columns[2::2, 2] = series / length, series / breadth
        try:
            h = np.array([[0, 1, 0, -1], [1, -1, 0, 0], [0, 0, -1, 1]], dtype=float)
            y = h.T @ columns.T @ np.linalg.solve(matrix, columns) @ h
        except np.linalg.LinAlgError:
            return [1e300] * 4
        link = np.array([[1.0, -1.0], [-1.0, 1.0]])
        y[:2, :2] += breadth / length * link
        y[2:, 2:] += length / breadth / case.lower * link
        return _from_y(y) if np.isfinite(y).all() else [1e300] * 4


def scale_errors(ratio: float) -> tuple[float, float]:
    """Return worst relative errors of the slant distance from exact potentials, W/r1 = ratio: (equation 20, ours)."""
    naive = ours = 0.0
    r1, width = 0.1, 0.1 * ratio
    r2 = r1 + width
    sheet = SectorSheet.of_sector(r1, width, 1e-3)
    for fraction in (1e-3, 0.1, 0.5, 0.9):
        with mp.workdps(60):
            volts = 1 - mp.log(1 + mp.mpf(fraction) * mp.mpf(width) / mp.mpf(r1)) / mp.log(
                1 + mp.mpf(width) / mp.mpf(r1)
            )
            v = float(volts)
            x = mp.log(1 + mp.mpf(width) / mp.mpf(r1)) * (1 - mp.mpf(v))
            exact = mp.mpf(r1) * mp.expm1(x)
        naive = max(naive, abs(float((mp.mpf(r2 * (r1 / r2) ** v - r1) - exact) / exact)))
        u, _ = sheet.locate((1.0 - v) * sheet.length, 0.0)
        ours = max(ours, abs(float((mp.mpf(float(u)) - exact) / exact)))
    return naive, ours
