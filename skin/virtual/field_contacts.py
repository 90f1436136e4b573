"""Exact field as contact model of the virtual skin: any script of touches, in a tenth of a millisecond a frame.

The touches stay where they are while their force changes, so ``_FixedDiscs`` works out what depends on the places when
a touch begins (0.5 to 5 ms), and each moment after is one small system. Around a fixed middle everything outside a disc
is harmonic, so its m-th Fourier coefficient goes with radius^m, exactly. The coupling K of `multipole` for any radii up
to the largest is therefore one matrix, scaled; only the discs' own answer D changes with force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError
from coneskin.skin.field.circles import green_block, make_circles
from coneskin.skin.field.disc import Discs, bessel_ratios, centre_distance, check_discs
from coneskin.skin.field.fourport import Coupling
from coneskin.skin.field.green import Strip
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import resolution, solve_to_tolerance
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor

from .circuit import LayerContact, Matrix, ResistorLadder, _check_place


@dataclass(frozen=True, slots=True, eq=False)
class _FixedDiscs:
    """The places of k contacts on a sheet, and all that does not depend on how firmly they are pressed."""

    model: FieldModel  #: the sheet and its resistances
    largest: Floats  #: radius up to which each contact may grow [m], shape (k,)
    order: int  #: multipole order M that the model's tolerance needs at these radii and a perfect bond
    block: Floats  #: K between the places at their largest radii, in units of Ru + Rl, shape (k, 2M+1, k, 2M+1)
    right: Floats  #: f for h0, hx and hy, shape (k, 2M+1, 3)
    error: float  #: estimate of the error at these radii, relative to the supply; smaller contacts have a smaller one

    @classmethod
    def of(cls, model: FieldModel, u: ArrayLike, phi: ArrayLike, largest: ArrayLike) -> _FixedDiscs:
        """Prepare places u [m] and phi [rad] of contacts that may grow up to the largest radii [m], each of shape (k,).

        Raises:
            FieldError: a disc of the largest radius cuts an edge or overlaps another, or the tolerance cannot be met.
        """
        us, phis, radii = (np.array([v], dtype=np.float64) for v in np.broadcast_arrays(u, phi, largest))
        discs = Discs(us, phis, radii, np.full_like(radii, math.inf))
        sheet, upper, lower = model.sheet, model.upper_resistance, model.lower_resistance
        check_discs(sheet, discs)
        k = discs.u.shape[1]
        order = int(resolution(sheet, discs, model.contrast, model.tolerance)[0])
        coupling, moments = solve_to_tolerance(sheet, upper, lower, discs, order, model.tolerance)
        order = moments.shape[2] // 2
        strip = Strip.of(sheet.length, sheet.breadth)
        a, b = (lower, upper) if strip.along_x else (upper, lower)
        circles = make_circles(sheet, strip, discs, order, 2 * order + 2, with_images=a != b)
        size = 2 * order + 1
        block = np.empty((k, size, k, size))
        for i in range(k):
            for j in range(i + 1):
                one, _ = green_block(strip, circles, i, j, a / (a + b), b / (a + b))
                block[i, :, j, :], block[j, :, i, :] = one[0], one[0].T
        right = np.zeros((k, size, 3))
        right[:, 0, 0] = 1.0
        right[:, :, 1], right[:, :, 2] = circles.x[0], circles.y[0]
        return cls(model, discs.radius[0], order, block, right, float(coupling.error[0]))

    def coupling(self, radius: ArrayLike, conductance: ArrayLike) -> Coupling:
        """Compute the six numbers of n moments.

        Args:
            radius: of each contact [m], above 0 and at most the largest, shape (n, k).
            conductance: per area [S/m^2], above 0 to inf, shape (n, k).

        Raises:
            FieldError: a radius or a conductance out of range.
        """
        radius, conductance = np.asarray(radius, dtype=np.float64), np.asarray(conductance, dtype=np.float64)
        part = radius / self.largest
        if not ((part > 0.0) & (part <= 1.0 + 1e-12)).all():
            raise FieldError(f"radius of a contact must be above 0 and at most {self.largest} m, got {radius} m")
        if not (conductance > 0.0).all():
            raise FieldError(f"conductance of a contact must be above 0 S/m^2, got {conductance} S/m^2")
        n, k = radius.shape
        order, size = self.order, 2 * self.order + 1
        rs = self.model.upper_resistance + self.model.lower_resistance
        ka = np.sqrt(conductance * rs) * radius
        ratios = bessel_ratios(ka, order + 1)
        m = np.arange(1, order + 1)
        grown = np.sqrt(2.0 * math.pi * m * ratios[:, :, :-1] * ratios[:, :, 1:]) * part[:, :, None] ** m
        # Its own logarithm counts from the disc's rim, and the rim has moved in.
        own = 1.0 / (2.0 * math.pi * ka * ratios[:, :, 0]) - np.log(part) / (2.0 * math.pi)
        scale = np.empty((n, k, size))
        scale[:, :, 1::2] = scale[:, :, 2::2] = grown
        places = np.arange(k)
        scale[:, :, 0] = 1.0 / np.sqrt(own + self.block[places, 0, places, 0])
        matrix = scale[:, :, :, None, None] * self.block * scale[:, None, None, :, :]
        flat = matrix.reshape(n, k * size, k * size)
        diagonal = np.arange(k * size)
        flat[:, diagonal, diagonal] += 1.0
        matrix[:, places, 0, places, 0] = 1.0
        right = (self.right * scale[..., None]).reshape(n, k * size, 3)
        w = right.transpose(0, 2, 1) @ np.linalg.solve(flat, right) / rs
        centre = np.broadcast_to(self.right[:, 0, 1:].mean(axis=0), (n, 2))
        return Coupling.of_matrix(0.5 * (w + w.transpose(0, 2, 1)), centre, np.full(n, self.error))


_CACHE_SIZE = 64  # sets of places; one for each combination of touches
_MAX_REACH = 0.95  # part of the way to an edge that a disc may take
_POINT_RADIUS = 1e-3  # m; of a contact that has none of its own
_FIELD_TOLERANCE = 1e-7  # of the supply, of the potentials; a count of 16 bits is 1.5e-5
_Key = tuple[tuple[float, float, float], ...]


class FieldContacts:
    """Contact model of round contacts with the exact field around them.

    What cannot be a disc inside the sheet is replaced by one that can: of a contact across an edge, the disc about the
    centroid of the part that is on the sheet, with that part's conductance; of contacts that overlap at their firmest,
    one about their common middle where they overlap by more than half, otherwise smaller ones of the same conductance.
    """

    def __init__(self) -> None:
        self._setting = lru_cache(maxsize=_CACHE_SIZE)(_Setting.of)

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene the 4 x 4 matrix Y [S] in the order A, B, C, D: symmetric, its rows sum to zero.

        Raises:
            FieldError: a conductance is negative, not finite or NaN, or a contact's middle is off the sensor.
        """
        found: dict[_Key, list[tuple[int, list[LayerContact]]]] = {}
        for number, contacts in enumerate(scenes):
            touching = [self._checked(sensor, contact) for contact in contacts if contact.conductance != 0.0]
            key = tuple((c.u, c.phi, c.reach) for c in touching)
            found.setdefault(key, []).append((number, touching))
        out: list[Matrix] = [()] * len(scenes)
        for key, group in found.items():
            if not key:
                matrices: list[Matrix] = ResistorLadder().admittances(sensor, [()] * len(group))
            else:
                matrices = self._setting(sensor, key).admittances([touching for _, touching in group])
            for (number, _), matrix in zip(group, matrices, strict=True):
                out[number] = matrix
        return out

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute a contact's place before it is touched, so that nothing waits for it then."""
        self.admittances(sensor, [[contact]])

    def _checked(self, sensor: Sensor, contact: LayerContact) -> LayerContact:
        _check_place(sensor, contact, FieldError)
        if not 0.0 <= contact.conductance < math.inf:
            raise FieldError(f"conductance of a contact must be 0 or more and finite [S], got {contact.conductance!r}")
        radius = contact.radius or _POINT_RADIUS
        return contact._replace(radius=radius, reach=max(contact.reach, radius))


class _Spot(NamedTuple):
    """The disc that stands for one contact, or for several that overlap."""

    u: float
    phi: float
    reach: float  #: its radius at its firmest [m]
    members: tuple[int, ...]  #: the contacts that it stands for
    on_sheet: float  #: part of their conductance that is on the sheet


class _Setting(NamedTuple):
    """Contacts at their places, ready for any force."""

    places: _FixedDiscs
    spots: tuple[_Spot, ...]
    reaches: tuple[float, ...]  #: what the spots' radii are at the contacts' firmest, before any is made smaller

    @classmethod
    def of(cls, sensor: Sensor, key: _Key) -> _Setting:
        sheet = SectorSheet.of_frustum(sensor.frustum)
        model = FieldModel(sheet, sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, _FIELD_TOLERANCE)
        spots = _merged(sheet, [_clipped(sheet, sensor, *one, n) for n, one in enumerate(key)])
        limits = _limits(sheet, spots)
        u, phi = [spot.u for spot in spots], [spot.phi for spot in spots]
        return cls(_FixedDiscs.of(model, u, phi, limits), tuple(spots), tuple(spot.reach for spot in spots))

    def admittances(self, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        radius = np.empty((len(scenes), len(self.spots)))
        siemens = np.empty_like(radius)
        for row, contacts in enumerate(scenes):
            for column, spot in enumerate(self.spots):
                members = [contacts[n] for n in spot.members]
                radius[row, column] = math.sqrt(sum(c.radius * c.radius for c in members))
                siemens[row, column] = spot.on_sheet * sum(c.conductance for c in members)
        radius *= np.minimum(self.places.largest / self.reaches, 1.0)
        np.minimum(radius, self.places.largest, out=radius)
        coupling: Coupling = self.places.coupling(radius, siemens / (math.pi * radius * radius))
        return [tuple(map(tuple, y)) for y in self.places.model.admittance(coupling).tolist()]


def _clipped(sheet: SectorSheet, sensor: Sensor, u: float, phi: float, reach: float, number: int) -> _Spot:
    """Return the part of a disc that is on the sheet, at its firmest: its centroid, and how much of the disc it is."""
    cuts = [_cut(distance / reach) for distance in sheet.edge_distances(u, phi).tolist()]
    (kept1, off1), (kept2, off2), (kept_d, off_d), (kept_c, off_c) = cuts
    u = _within(u + reach * (off1 - off2), sheet.width)
    phi = _within(phi + reach * (off_d - off_c) / sensor.frustum.radius_at(u), sheet.wrap)
    return _Spot(u, phi, reach, (number,), kept1 * kept2 * kept_d * kept_c)


def _within(value: float, end: float) -> float:
    return min(max(value, 1e-3 * end), (1.0 - 1e-3) * end)


def _cut(distance: float) -> tuple[float, float]:
    """Return what an edge at a distance leaves of the unit disc: part of its area, and offset of its centroid."""
    if distance >= 1.0:
        return 1.0, 0.0
    sine = math.sqrt(1.0 - distance * distance)
    kept = 1.0 - (math.acos(distance) - distance * sine) / math.pi
    return kept, 2.0 / 3.0 * sine**3 / (math.pi * kept)


def _merged(sheet: SectorSheet, spots: list[_Spot]) -> list[_Spot]:
    """Merge the contacts that overlap by more than half."""
    done: list[_Spot] = []
    for spot in spots:
        while True:
            near = [s for s in done if _apart(sheet, spot, s) <= 0.5 * (spot.reach + s.reach)]
            if not near:
                break
            other = near[0]
            done.remove(other)
            own, others = spot.reach**2 * spot.on_sheet, other.reach**2 * other.on_sheet
            part = others / (own + others)
            spot = _Spot(
                (1.0 - part) * spot.u + part * other.u,
                (1.0 - part) * spot.phi + part * other.phi,
                math.hypot(spot.reach, other.reach),
                spot.members + other.members,
                (1.0 - part) * spot.on_sheet + part * other.on_sheet,
            )
        done.append(spot)
    return done


def _limits(sheet: SectorSheet, spots: Sequence[_Spot]) -> list[float]:
    """Return the largest radii at which all are inside the sheet and apart."""
    radii = [min(spot.reach, _MAX_REACH * float(sheet.edge_distances(spot.u, spot.phi).min())) for spot in spots]
    for i, first in enumerate(spots):
        for j in range(i):
            ratio = _MAX_REACH * _apart(sheet, first, spots[j]) / (radii[i] + radii[j])
            if ratio < 1.0:
                radii[i], radii[j] = radii[i] * ratio, radii[j] * ratio
    return radii


def _apart(sheet: SectorSheet, first: _Spot, second: _Spot) -> float:
    places = (np.array([value]) for value in (first.u, first.phi, second.u, second.phi))
    return float(centre_distance(sheet, *places)[0])
