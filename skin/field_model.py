"""The forward model: a sheet, two resistances, contacts -> what the four electrodes read.

model = FieldModel(SectorSheet.of_frustum(link), upper_resistance=100.0, lower_resistance=100.0)
readings = solve(model, [Disc(u=0.05, phi=0.6, radius=0.005)], radial_phase(supply=5.0))
readings.terminals[0]          # A, B, C, D [V]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coneskin.errors import FieldError

from .field_coupling import Coupling, admittance
from .field_disc import Disc, Discs, check_discs
from .field_discs import solve_discs
from .field_fourport import Phase, Readings, solve_phase
from .field_resolution import LADDER, higher, resolution
from .field_sheet import SectorSheet

__all__ = ["FieldModel", "solve", "solve_many"]

Floats = NDArray[np.float64]

#: Pairs of points in one piece of a batch, measured: larger pieces leave the cache.
PAIRS_AT_ONCE = 12000


@dataclass(frozen=True, slots=True)
class FieldModel:
    """The sensor without contacts.

    Attributes:
        sheet: the flat sector that both conductive layers share.
        upper_resistance: sheet resistance of the layer with the electrodes A and B [ohm per square].
        lower_resistance: sheet resistance of the layer with the electrodes C and D [ohm per square].
        tolerance: truncation that the automatic order aims at, relative to the supply.

    Raises:
        FieldError: a resistance is not positive and finite, the tolerance is not in [1e-15, 0.1].
    """

    sheet: SectorSheet
    upper_resistance: float
    lower_resistance: float
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        for name in ("upper_resistance", "lower_resistance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise FieldError(f"{name} must be positive and finite [ohm per square], got {value!r}")
        if not 1e-15 <= self.tolerance <= 0.1:
            raise FieldError(f"tolerance must be in [1e-15, 0.1] of the supply, got {self.tolerance!r}")

    @property
    def contrast(self) -> float:
        """|Ru - Rl| / (Ru + Rl): 0 for equal sheets."""
        return abs(self.upper_resistance - self.lower_resistance) / (self.upper_resistance + self.lower_resistance)

    def discs(self, discs: Sequence[Disc], order: int | None = None) -> Coupling:
        """Coupling of one scene (n = 1) of several discs that do not overlap.

        Args:
            discs: at least one.
            order: multipole order M; None chooses it for the model's tolerance.

        Raises:
            FieldError: a disc that cannot be (see `check_discs`), or none at all.
        """
        if not discs:
            raise FieldError("at least one contact is needed; for no contact give one of conductance 0")
        u, phi, radius, conductance = (
            np.array([[getattr(d, name) for d in discs]]) for name in ("u", "phi", "radius", "conductance")
        )
        return self.contacts(u, phi, radius, conductance, order=order)

    def contacts(
        self,
        u: ArrayLike,
        phi: ArrayLike,
        radius: ArrayLike,
        conductance: ArrayLike = math.inf,
        order: int | None = None,
    ) -> Coupling:
        """Coupling of n scenes: shape (n,) for one disc in each, (n, k) for k discs; arguments broadcast.

        Args:
            u: slant distance of the centres from end 1 [m].
            phi: azimuth of the centres [rad].
            radius: in the flat sheet [m].
            conductance: per area [S/m^2], 0 to inf.
            order: multipole order M; None chooses it for each scene from the model's tolerance.

        Raises:
            FieldError: a disc that cannot be.
        """
        arrays = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (u, phi, radius, conductance)))
        if arrays[0].ndim not in (0, 1, 2):
            raise FieldError(f"contacts must have shape (n,) or (n, k), got {arrays[0].shape}")
        shaped = [a.reshape(-1, 1) if a.ndim < 2 else a for a in arrays]
        check_discs(self.sheet, *shaped)
        if order is not None and order < 1:
            raise FieldError(f"order must be at least 1, got {order}")
        return self._in_groups(Discs(*shaped), order)

    def admittance(self, coupling: Coupling) -> Floats:
        """Y of the 4-port (A, B, C, D) [S], shape (n, 4, 4)."""
        return admittance(coupling, self.sheet, self.upper_resistance, self.lower_resistance)

    def read(self, coupling: Coupling, phase: Phase) -> Readings:
        """Potentials and currents of one phase.

        Raises:
            FieldError: a sheet without contact whose electrodes are both open.
        """
        return solve_phase(coupling, self.sheet, self.upper_resistance, self.lower_resistance, phase)

    def _in_groups(self, discs: Discs, order: int | None) -> Coupling:
        """Scenes of one resolution together; those whose multipoles have not yet died away again, at a higher order."""
        n = discs.u.shape[0]
        out = np.empty((6, n))
        orders = resolution(self.sheet, discs, self.contrast, self.tolerance, order)
        waiting = np.arange(n)
        while waiting.size:
            again = []
            for m in sorted(set(orders[waiting].tolist())):
                group = waiting[orders[waiting] == m]
                left = self._solve_group(discs, m, group, out, order is None)
                again.append(group[left > self.tolerance])
            waiting = np.concatenate(again) if order is None else waiting[:0]
            waiting = waiting[orders[waiting] < LADDER[-1]]
            orders[waiting] = [higher(int(m)) for m in orders[waiting]]
        if not (out[0] >= 0.0).all():
            raise FieldError("a contact next to an edge or to another needs a higher order than was given")
        return Coupling(*out)

    def _solve_group(self, discs: Discs, order: int, group: NDArray[np.intp], out: Floats, free: bool) -> Floats:
        chunk = max(1, PAIRS_AT_ONCE // ((2 * order + 2) * discs.u.shape[1]) ** 2)
        tail = np.empty(group.size)
        # One disc between equal sheets has no near image, and the order chosen for it holds.
        estimate = free and (self.contrast > 0.0 or discs.u.shape[1] > 1)
        for start in range(0, group.size, chunk):
            index = group[start : start + chunk]
            part = Discs(discs.u[index], discs.phi[index], discs.radius[index], discs.conductance[index])
            got, _, left = solve_discs(
                self.sheet, self.upper_resistance, self.lower_resistance, part, order, estimate=estimate
            )
            out[:, index] = (got.conductance, got.x, got.y, got.xx, got.xy, got.yy)
            tail[start : start + chunk] = left
        return tail


def solve(model: FieldModel, discs: Sequence[Disc], *phases: Phase) -> tuple[Readings, ...]:
    """Readings of one scene of discs in each phase."""
    coupling = model.discs(discs)
    return tuple(model.read(coupling, phase) for phase in phases)


def solve_many(
    model: FieldModel,
    u: ArrayLike,
    phi: ArrayLike,
    radius: ArrayLike,
    conductance: ArrayLike,
    *phases: Phase,
) -> tuple[Readings, ...]:
    """Readings of n single contacts in each phase; arguments as for `FieldModel.contacts`."""
    coupling = model.contacts(u, phi, radius, conductance)
    return tuple(model.read(coupling, phase) for phase in phases)
