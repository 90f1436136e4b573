"""Field of a sheet: its potential in a phase, with the contact whose conductance gives the level that was read.

A touch says where it is and how firm, not how large: the contact is a disc of 5 mm, smaller beside an edge. Its
conductance is the one with which the exact model (``coneskin.skin.field``) reads the level.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.skin.field.disc import Disc
    from coneskin.skin.field.fourport import DrivePhase
    from coneskin.skin.sensor import Sensor

__all__ = ["PHASES", "ContactOnSheet", "SheetField"]

#: what can be drawn -> the phase, and whether it is the upper sheet
PHASES = {
    "radial phase, upper sheet": ("radial", True),
    "angular phase, lower sheet": ("angular", False),
    "touch phase, upper sheet": ("touch", True),
    "touch phase, lower sheet": ("touch", False),
}
_RADIUS = 0.005  # m; of the disc
_ROOM = 0.8  # of the way to the nearest edge, that the disc takes at most
_TOLERANCE = 1e-6  # of the supply; a colour is far coarser
_TRIED = 49  # conductances
_LEAST, _MOST = 1e-8, 1e-1  # S


class ContactOnSheet(NamedTuple):
    """Contact: u [m], phi [rad], and the touch level that was read."""

    u: float
    phi: float
    level: float


class SheetField:
    """Field of one sensor at fixed points.

    Args:
        sensor: the sensor.
        u: slant distances of the points from end 1 [m].
        phi: azimuths of the points [rad], in the shape of ``u``.

    Attributes:
        supply: the potential that drives it [V].
    """

    def __init__(self, sensor: Sensor, u: NDArray[np.float64], phi: NDArray[np.float64]) -> None:
        from coneskin.skin.field.model import FieldModel
        from coneskin.skin.field.sheet import SectorSheet

        self.supply = sensor.electronics.supply_volts
        self._sensor, self._u, self._phi = sensor, u, phi
        self._model = FieldModel(
            SectorSheet.of_frustum(sensor.frustum), sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, _TOLERANCE
        )
        self._known: tuple[object, NDArray[np.float64]] | None = None

    def potentials(self, what: str, contact: ContactOnSheet | None) -> NDArray[np.float64]:
        """Return the potentials at the points [V].

        Args:
            what: one of ``PHASES``.
            contact: on the sheet; None for none, and where it is too near to an edge for a disc it is left out.

        Raises:
            FieldError: the model cannot solve this contact.
        """
        from coneskin.skin.field.maps import FieldMap

        name, upper = PHASES[what]
        near = None if contact is None else (round(contact.u, 3), round(contact.phi, 2), round(contact.level, 2))
        if self._known is not None and self._known[0] == (what, near):
            return self._known[1]
        phase = self._phase(name)
        disc = None if contact is None else self._disc(contact)
        by_upper, by_lower = FieldMap.of(self._model, () if disc is None else (disc,), phase).potentials(
            self._u, self._phi
        )
        found = by_upper if upper else by_lower
        self._known = ((what, near), found)
        return found

    def _disc(self, contact: ContactOnSheet) -> Disc | None:
        """Return the disc that reads the contact's level; None where there is no room for one, or the level is 0."""
        import numpy as np

        from coneskin.skin.field.disc import Disc

        sheet = self._model.sheet
        u = min(max(contact.u, 0.0), sheet.width)
        phi = min(max(contact.phi, 0.0), sheet.wrap)
        radius = min(_RADIUS, _ROOM * float(sheet.edge_distances(u, phi).min()))
        if radius < 1e-4 or contact.level <= 0.0:
            return None
        tried = np.geomspace(_LEAST, _MOST, _TRIED) / (math.pi * radius * radius)
        coupling = self._model.contacts(np.full(_TRIED, u), np.full(_TRIED, phi), radius, tried)
        guides = self._model.read(coupling, self._phase("touch")).terminals[:, 2:]
        levels = guides.mean(axis=1) / self.supply  # rises with the conductance
        return Disc(u, phi, radius, float(np.exp(np.interp(contact.level, levels, np.log(tried)))))

    def _phase(self, name: str) -> DrivePhase:
        """Return a phase as the electronics of the sensor make it."""
        from coneskin.skin.field.fourport import DrivePhase, Terminal

        parts, leads = self._sensor.electronics, self._sensor.electronics.lead_ohms

        def driven(volts: float, lead: float) -> Terminal:
            return Terminal(volts, 0.0, lead)

        def read(ohms: float, lead: float) -> Terminal:
            return Terminal(0.0, ohms, lead)

        supply, b, c = parts.supply_volts, self._sensor.b_positive, self._sensor.c_positive
        if name == "radial":
            upper = driven(0.0 if b else supply, leads.a), driven(supply if b else 0.0, leads.b)
            return DrivePhase(name, *upper, read(parts.input_ohms, leads.c), read(parts.input_ohms, leads.d))
        if name == "angular":
            lower = driven(supply if c else 0.0, leads.c), driven(0.0 if c else supply, leads.d)
            return DrivePhase(name, read(parts.input_ohms, leads.a), read(parts.input_ohms, leads.b), *lower)
        guides = read(parts.pulldown_ohms, leads.c), read(parts.pulldown_ohms, leads.d)
        return DrivePhase(name, driven(supply, leads.a), driven(supply, leads.b), *guides)
