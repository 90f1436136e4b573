"""Sheets as they are built: resistance that varies and has directions, electrodes with ohms of their own and gaps.

Bilinear elements in the rectangle of the conformal map, which leaves a conductivity tensor in the directions of u and
phi as it is. Each electrode is a line of resistors, fed at its end at D or B and bonded to the edge but where it has
peeled off. A contact is a set of points with conductances; the sheets' answer between them is one small matrix, kept
for each place. What the mesh itself is off cancels: to the exact field of the ideal sheets is added what these elements
find for the built sheets, less what they find for ideal ones.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import SensorError
from coneskin.skin.electronics import LeadOhms
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import SheetTolerance

from .circuit import ContactModel, LayerContact, Matrix
from .skin import contact_model

_CELL_COUNT = 48  # of the mesh, along each side
_BOND_SIEMENS = 200.0  # S for a whole electrode; silver on a film has milliohms
_LEAST_LINE = 1e-4  # ohm; of an electrode that has none
_PATCH_WAVES = 4  # half waves of patches along a side, at most
_RING_POINTS = ((0.0, 1), (0.45, 6), (0.82, 12))  # radius over the contact's, points; equal areas nearly
_CACHE_SIZE = 128  # places whose matrices are kept


@dataclass(frozen=True, slots=True)
class _SheetFlaws:
    """What is not ideal about one sheet. x runs from its first electrode (B, D) to its second (A, C), 0 to 1.

    Raises:
        SensorError: no sheet can be so.
    """

    slope: float = 0.0  #: change of its resistance from the first electrode to the second, a ratio
    slope_across: float = 0.0  #: from one insulated edge to the other
    patches: float = 0.0  #: standard deviation of its resistance from place to place, a ratio
    skew: float = 0.0  #: conductance across the field over that along it; how aslant current runs
    stretch: float = 0.0  #: conductance across over that along, less 1
    lines: tuple[float, float] = (0.0, 0.0)  #: of both electrodes from end to end [ohm]
    peeled: float = 0.0  #: part of the first electrode that is not bonded, in its middle
    seed: int = 0  #: of the patches

    def __post_init__(self) -> None:
        if not (abs(self.slope) + abs(self.slope_across) < 1.5 and 0.0 <= self.patches < 0.3):
            found = f"{self.slope:.3g}, {self.slope_across:.3g} and {self.patches:.3g}"
            raise SensorError(
                f"slopes must together be less than 1.5, and patches from 0 to less than 0.3, got {found}"
            )
        if not (self.skew**2 < 1.0 + self.stretch and 0.0 <= self.peeled < 1.0 and min(self.lines) >= 0.0):
            found = f"{self.skew:.3g}, {self.stretch:.3g}, {self.peeled:.3g}, {min(self.lines):.3g}"
            raise SensorError(
                f"skew^2 must be less than 1 + stretch, peeled from 0 to less than 1, lines at least 0 ohm, got {found}"
            )

    def resistance(self, x: Floats, y: Floats) -> Floats:
        """Return its resistance over that of the scene at parts of the sides."""
        value = 1.0 + self.slope * (x - 0.5) + self.slope_across * (y - 0.5)
        if self.patches:
            rng = np.random.default_rng(self.seed)
            waves = [(i, j) for i in range(_PATCH_WAVES) for j in range(_PATCH_WAVES) if i + j]
            size = self.patches * math.sqrt(4.0 / len(waves))
            for i, j in waves:
                phase = rng.uniform(0.0, 2.0 * math.pi, 2)
                value = value + size * rng.normal() * np.cos(math.pi * i * x + phase[0]) * np.cos(
                    math.pi * j * y + phase[1]
                )
        return np.maximum(value, 0.05)


def _draw_flaws(tolerance: SheetTolerance, seed: int) -> tuple[_SheetFlaws, _SheetFlaws]:
    """Return an upper and a lower sheet, drawn from what a class of sheets is like."""
    rng = random.Random(f"sheets {seed}")

    def one() -> _SheetFlaws:
        slope, across = rng.gauss(0.0, tolerance.slope), rng.gauss(0.0, tolerance.slope)
        return _SheetFlaws(
            *(slope, across, tolerance.patches),
            *(rng.gauss(0.0, tolerance.skew), rng.gauss(0.0, tolerance.skew)),
            lines=(abs(rng.gauss(0.0, tolerance.line)), abs(rng.gauss(0.0, tolerance.line))),
            seed=rng.getrandbits(31),
        )

    return one(), one()


class _BuiltSheet:
    """One sheet with its two electrodes, x along its field; its size is from electrode to electrode, and across [m]."""

    def __init__(self, flaws: _SheetFlaws, size: tuple[float, float], ohms: float) -> None:
        from scipy.sparse import coo_matrix
        from scipy.sparse.linalg import splu

        n = _CELL_COUNT
        middle = (np.arange(n) + 0.5) / n
        x, y = np.meshgrid(middle, middle, indexing="ij")
        along = 1.0 / (ohms * flaws.resistance(x, y)).ravel()
        hx, hy = size[0] / n, size[1] / n
        xx = hy / hx / 6.0 * np.array([[2, -2, -1, 1], [-2, 2, 1, -1], [-1, 1, 2, -2], [1, -1, -2, 2]], float)
        yy = hx / hy / 6.0 * np.array([[2, 1, -1, -2], [1, 2, -2, -1], [-1, -2, 2, 1], [-2, -1, 1, 2]], float)
        xy = 0.5 * np.array([[1, 0, -1, 0], [0, -1, 0, 1], [-1, 0, 1, 0], [0, 1, 0, -1]], float)
        element = xx + (1.0 + flaws.stretch) * yy + flaws.skew * xy
        i, j = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        node = i * (n + 1) + j
        corners = np.stack([node, node + n + 1, node + n + 2, node + 1], axis=1)
        rows, columns = np.repeat(corners, 4, axis=1).ravel(), np.tile(corners, (1, 4)).ravel()
        values = (along[:, None] * element.ravel()).ravel()
        parts = [(rows, columns, values)]
        whole = (n + 1) ** 2
        edge = np.arange(n + 1)
        for number, (line, peeled) in enumerate(zip(flaws.lines, (flaws.peeled, 0.0), strict=True)):
            wire = whole + number * (n + 1) + edge
            foot = edge + number * n * (n + 1)
            bond = np.full(n + 1, _BOND_SIEMENS / n)
            bond[np.abs(edge / n - 0.5) < 0.5 * peeled] = 0.0
            chain = np.full(n, n / max(line, _LEAST_LINE))
            for first, second, siemens in ((wire, foot, bond), (wire[1:], wire[:-1], chain)):
                parts += [
                    (np.r_[first, second], np.r_[first, second], np.r_[siemens, siemens]),
                    (np.r_[first, second], np.r_[second, first], -np.r_[siemens, siemens]),
                ]
        rows, columns, values = (np.concatenate([part[k] for part in parts]) for k in range(3))
        total = whole + 2 * (n + 1)
        matrix = coo_matrix((values, (rows, columns)), (total, total)).tocsc()
        ends = np.array([whole, whole + n + 1])
        free = np.setdiff1d(np.arange(total), ends)
        self._solver = splu(matrix[free][:, free].tocsc())
        ports = matrix[free][:, ends].toarray()
        answer = -self._solver.solve(ports)
        self.own: Floats = matrix[ends][:, ends].toarray() + ports.T @ answer
        self.answer: Floats = np.zeros((whole, 2))
        inside = free[free < whole]
        self.answer[inside] = answer[: inside.size]
        self._size = free.size
        self._column = cache(self._solve_column)

    def _solve_column(self, node: int) -> Floats:
        right = np.zeros(self._size)
        right[node] = 1.0  # the nodes of the sheet come first, and no end is among them
        return np.asarray(self._solver.solve(right))

    def coupling(self, points: Sequence[tuple[Any, Any]]) -> Floats:
        """Return the potentials [ohm] that a current into each point makes at each, both electrodes at ground."""
        nodes = sorted({int(k) for index, _ in points for k in index})
        between = np.array([self._column(k)[nodes] for k in nodes])
        weights = np.zeros((len(points), len(nodes)))
        for row, (index, share) in enumerate(points):
            weights[row, np.searchsorted(nodes, index)] += share
        return np.asarray(weights @ between @ weights.T)


def _shares(x: float, y: float) -> tuple[Any, Any]:
    """Return the four nodes around a point at parts of the sides, and their shares of it."""
    n = _CELL_COUNT
    i, j = min(max(int(x * n), 0), n - 1), min(max(int(y * n), 0), n - 1)
    s, t = min(max(x * n - i, 0.0), 1.0), min(max(y * n - j, 0.0), 1.0)
    node = i * (n + 1) + j
    return np.array([node, node + n + 1, node + n + 2, node + 1]), np.array(
        [(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t]
    )


class _Pair:
    """The two sheets of one sensor, and their answers at the places that were asked for."""

    def __init__(self, sensor: Sensor, flaws: tuple[_SheetFlaws, _SheetFlaws]) -> None:
        cone = sensor.frustum
        self.curvature = cone.sin_half_angle / cone.radius1
        self.length = math.log1p(self.curvature * cone.slant) / self.curvature if self.curvature else cone.slant
        self.breadth = cone.radius1 * cone.wrap
        self._wrap = cone.wrap
        self._upper = _BuiltSheet(flaws[0], (self.length, self.breadth), sensor.upper_sheet_ohms)
        self._lower = _BuiltSheet(flaws[1], (self.breadth, self.length), sensor.lower_sheet_ohms)
        self.bare: Floats = np.zeros((4, 4))
        self.bare[np.ix_((1, 0), (1, 0))] = self._upper.own
        self.bare[np.ix_((3, 2), (3, 2))] = self._lower.own
        self._prepared = lru_cache(maxsize=_CACHE_SIZE)(self._prepare)

    def admittance(self, contacts: Sequence[LayerContact]) -> Floats:
        """Return Y of A, B, C, D [S]."""
        contacts = [c for c in contacts if c.conductance > 0.0]
        if not contacts:
            return self.bare
        between, force = self._prepared(tuple((c.u, c.phi, round(c.radius, 3)) for c in contacts))
        count = sum(number for _, number in _RING_POINTS)
        ohms = np.repeat([count / c.conductance for c in contacts], count)
        return np.asarray(self.bare + force.T @ np.linalg.solve(np.diag(ohms) + between, force))

    def _prepare(self, places: tuple[tuple[float, float, float], ...]) -> tuple[Floats, Floats]:
        """Return the coupling of all points [ohm], and the differences that the electrodes impose there."""
        uppers, lowers = [], []
        for u, phi, radius in places:
            stretch = 1.0 + self.curvature * u
            x0 = math.log(stretch) / self.curvature if self.curvature else u
            for ring, number in _RING_POINTS:
                for k in range(number):
                    angle = 2.0 * math.pi * (k + 0.5) / number
                    x = (x0 + ring * radius / stretch * math.cos(angle)) / self.length
                    y = phi / self._wrap + ring * radius / stretch * math.sin(angle) / self.breadth
                    uppers.append(_shares(x, y))
                    lowers.append(_shares(y, x))
        between = self._upper.coupling(uppers) + self._lower.coupling(lowers)
        force = np.zeros((len(uppers), 4))
        for row, ((upper, part1), (lower, part2)) in enumerate(zip(uppers, lowers, strict=True)):
            force[row, [1, 0]] = part1 @ self._upper.answer[upper]
            force[row, [3, 2]] = -(part2 @ self._lower.answer[lower])
        return between, force


class _BuiltSheets:
    """Contact model of an upper and a lower sheet as they are built, beside the exact one of ideal sheets."""

    def __init__(self, flaws: tuple[_SheetFlaws, _SheetFlaws], exact: ContactModel) -> None:
        self._exact = exact
        self._pairs = lru_cache(maxsize=16)(lambda sensor: (_Pair(sensor, flaws), _Pair(sensor, _IDEAL_FLAWS)))

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene of contacts the matrix Y [S] of the electrodes A, B, C, D."""
        built, ideal = self._pairs(sensor)
        found = []
        for scene, exact in zip(scenes, self._exact.admittances(sensor, scenes), strict=True):
            matrix = np.array(exact) + built.admittance(scene) - ideal.admittance(scene)
            found.append(tuple(tuple(row) for row in matrix.tolist()))
        return found

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute beforehand what would take long when the sensor is touched there."""
        self._exact.prepare(sensor, contact)
        for pair in self._pairs(sensor):
            pair.admittance([contact])


_IDEAL_FLAWS = _SheetFlaws(), _SheetFlaws()


def build_specimen(
    sensors: Sequence[Sensor], tolerance: SheetTolerance, seed: int, model: str, peeled: float
) -> tuple[list[Sensor], ContactModel]:
    """Return sensors as they are built, with leads of their own, and the contact model of their sheets.

    Args:
        sensors: as their scene says.
        tolerance: what their leads and sheets are drawn from.
        seed: of that; the sheets of all are alike.
        model: of the ideal sheets, "field" or "ladder".
        peeled: part of electrode B that is not bonded.
    """
    rng = random.Random(f"leads {seed}")
    built = []
    for sensor in sensors:
        parts = sensor.electronics
        leads = LeadOhms(*(ohms + abs(rng.gauss(0.0, tolerance.lead)) for ohms in parts.lead_ohms))
        built.append(replace(sensor, electronics=replace(parts, lead_ohms=leads)))
    upper, lower = _draw_flaws(tolerance, seed)
    return built, _BuiltSheets((replace(upper, peeled=peeled), lower), contact_model(model))
