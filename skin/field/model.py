"""Forward model of the sensor: a sheet, two resistances and contacts give what the four electrodes read.

model = FieldModel(SectorSheet.of_frustum(link), upper_resistance=100.0, lower_resistance=100.0)
readings = solve(model, [Disc(u=0.05, phi=0.6, radius=0.005)], radial_phase(supply=5.0))
readings.terminals[0]          # A, B, C, D [V]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError

from .disc import Disc, Discs, check_discs
from .fourport import Coupling, DrivePhase, Readings, admittance, solve_phase
from .multipole import LADDER, higher, resolution, solve_discs
from .one_scene import SceneSolver
from .sheet import SectorSheet

#: Pairs of points in one piece of a batch, measured: larger pieces leave the cache.
PAIRS_AT_ONCE = 12000

#: Error that rounding leaves, relative to the supply: no tolerance below asks for more multipoles.
_ROUNDING_ERROR = 1e-13

_shared_solver = lru_cache(maxsize=64)(SceneSolver)  # one for equal sheets


@dataclass(frozen=True, slots=True)
class FieldModel:
    """The sensor without contacts.

    Attributes:
        sheet: the flat sector that both conductive layers share.
        upper_resistance: sheet resistance of the layer with the electrodes A and B [ohm per square].
        lower_resistance: sheet resistance of the layer with the electrodes C and D [ohm per square].
        tolerance: of every solution's estimated error, relative to the supply. Below 1e-13, what rounding leaves is
            taken for less.

    Raises:
        FieldError: a resistance is not positive and finite, the tolerance is not in [1e-15, 0.1].
    """

    sheet: SectorSheet
    upper_resistance: float
    lower_resistance: float
    tolerance: float = 1e-12
    _scenes: SceneSolver = field(init=False, repr=False, compare=False)
    _bare: tuple[float, float] = field(init=False, repr=False, compare=False)  # conductances without contacts [S]

    def __post_init__(self) -> None:
        for name in ("upper_resistance", "lower_resistance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise FieldError(f"{name} must be positive and finite [ohm per square], got {value!r}")
        if not 1e-15 <= self.tolerance <= 0.1:
            raise FieldError(f"tolerance must be in [1e-15, 0.1] of the supply, got {self.tolerance!r}")
        given = self.sheet, self.upper_resistance, self.lower_resistance, self.tolerance
        object.__setattr__(self, "_scenes", _shared_solver(*given))
        length, breadth = self.sheet.length, self.sheet.breadth
        bare = breadth / (self.upper_resistance * length), length / (self.lower_resistance * breadth)
        object.__setattr__(self, "_bare", bare)

    @property
    def contrast(self) -> float:
        """Contrast of the sheets, |Ru - Rl| / (Ru + Rl): 0 for equal sheets."""
        return abs(self.upper_resistance - self.lower_resistance) / (self.upper_resistance + self.lower_resistance)

    def discs(self, discs: Sequence[Disc]) -> Coupling:
        """Couple one scene (n = 1) of several discs that do not overlap.

        Raises:
            FieldError: a disc that cannot be (see `check_discs`), or none at all.
        """
        if not discs:
            raise FieldError("at least one contact is needed; for no contact give one of conductance 0")
        scene = [(d.u, d.phi, d.radius, d.conductance) for d in discs]
        return self._scenes.solve(scene) or self.contacts(*np.array([scene], dtype=np.float64).T.swapaxes(1, 2))

    def contacts(
        self,
        u: ArrayLike,
        phi: ArrayLike,
        radius: ArrayLike,
        conductance: ArrayLike = math.inf,
        order: int | None = None,
    ) -> Coupling:
        """Couple n scenes: shape (n,) for one disc in each, (n, k) for k discs; arguments broadcast.

        Args:
            u: slant distance of the centres from end 1 [m].
            phi: azimuth of the centres [rad].
            radius: in the flat sheet [m].
            conductance: per area [S/m^2], 0 to inf.
            order: multipole order M; None chooses it for each scene from the model's tolerance.

        Raises:
            FieldError: a disc that cannot be; the tolerance cannot be met (only without `order`).
        """
        values = np.broadcast(u, phi, radius, conductance)
        if values.ndim > 2:
            raise FieldError(f"contacts must have shape (n,) or (n, k), got {values.shape}")
        if order is None and (values.shape[0] if values.ndim == 2 else values.size) == 1:
            one = self._scenes.solve([(float(x), float(y), float(r), float(g)) for x, y, r, g in values])
            if one is not None:
                return one
        arrays = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (u, phi, radius, conductance)))
        scenes = Discs(*(a.reshape(-1, 1) if a.ndim < 2 else a for a in arrays))
        check_discs(self.sheet, scenes)
        if order is not None and order < 1:
            raise FieldError(f"order must be at least 1, got {order}")
        return self._in_groups(scenes, order)

    def admittance(self, coupling: Coupling) -> Floats:
        """Compute Y of the 4-port (A, B, C, D) [S], shape (n, 4, 4)."""
        return admittance(coupling, *self._bare)

    def read(self, coupling: Coupling, phase: DrivePhase) -> Readings:
        """Compute the potentials and currents of one phase.

        Raises:
            FieldError: a sheet without contact whose electrodes are both open.
        """
        return solve_phase(coupling, *self._bare, phase)

    def _in_groups(self, discs: Discs, order: int | None) -> Coupling:
        """Solve scenes of one resolution together; raise the order of those whose multipoles have not died away."""
        n = discs.u.shape[0]
        out = np.empty((7, n))
        orders = resolution(self.sheet, discs, self.contrast, self.tolerance, order)
        waiting = np.arange(n)
        while waiting.size:
            for m in sorted(set(orders[waiting].tolist())):
                self._solve_group(discs, m, waiting[orders[waiting] == m], out)
            if order is not None:
                break
            # Also where the estimate is no number.
            waiting = waiting[~(out[6, waiting] <= max(self.tolerance, _ROUNDING_ERROR))]
            for index in waiting[orders[waiting] == LADDER[-1]].tolist():
                self._refuse(discs, index, out[6, index])
            orders[waiting] = [higher(int(orders[i]), float(out[6, i]), self.tolerance) for i in waiting]
        if order is not None and not (out[0] >= 0.0).all():
            raise FieldError(
                f"order {order} is too low for a contact next to an edge or another contact: raise it, or leave it out"
            )
        return Coupling(*out)

    def _solve_group(self, discs: Discs, order: int, group: NDArray[np.intp], out: Floats) -> None:
        chunk = max(1, PAIRS_AT_ONCE // ((2 * order + 2) * discs.u.shape[1]) ** 2)
        for start in range(0, group.size, chunk):
            index = group[start : start + chunk]
            try:
                got, _ = solve_discs(
                    self.sheet, self.upper_resistance, self.lower_resistance, discs.scenes(index), order
                )
            except np.linalg.LinAlgError:
                if index.size > 1:
                    for one in index:
                        self._solve_group(discs, order, np.array([one]), out)
                else:
                    out[:, index] = math.nan
                continue
            out[:, index] = [getattr(got, name) for name in ("conductance", "x", "y", "xx", "xy", "yy", "error")]
            out[6, index[~(got.conductance >= 0.0)]] = math.nan

    def _refuse(self, discs: Discs, index: int, error: float) -> None:
        places = zip(discs.u[index].tolist(), discs.phi[index].tolist(), discs.radius[index].tolist(), strict=True)
        named = ", ".join(f"u={u:.6g} m, phi={phi:.6g} rad, radius {a:.6g} m" for u, phi, a in places)
        raise FieldError(
            f"the field of scene {index} ({named}) is solved only to about {error:.1g} of the supply, the tolerance is"
            f" {self.tolerance:g}: leave more room to the apex, to the edges and between contacts, or raise the model's"
            " tolerance"
        )


def solve(model: FieldModel, discs: Sequence[Disc], *phases: DrivePhase) -> tuple[Readings, ...]:
    """Return the readings of one scene of discs in each phase."""
    coupling = model.discs(discs)
    return tuple(model.read(coupling, phase) for phase in phases)
