"""Round contacts between two sheets, exactly: the virtual skin's contact model where the ladder is not good enough.

It puts the field of ``field_model`` behind the electronics of ``circuit``. A solve takes about half a millisecond
instead of the ladder's ten microseconds, so it suits touches that rest; numpy is needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.errors import SensorError

from .circuit import Contact, Matrix
from .ladder import Ladder
from .sensor import Sensor

__all__ = ["DiscContacts"]


class DiscContacts:
    """Contact model of round contacts with the exact field around them.

    Args:
        radius: of a contact that has none of its own [m].
        tolerance: of the potentials, relative to the supply.

    Raises:
        SensorError: radius is not positive.
    """

    def __init__(self, radius: float = 0.003, tolerance: float = 1e-9) -> None:
        if not (math.isfinite(radius) and radius > 0.0):
            raise SensorError(f"the radius of a contact must be finite and above 0 m, got {radius!r} m")
        self.radius = radius
        self.tolerance = tolerance

    def admittance(self, sensor: Sensor, contacts: Sequence[Contact]) -> Matrix:
        """The 4 x 4 matrix Y [S] in the order A, B, C, D.

        Args:
            sensor: the sheets.
            contacts: round, inside the sensor, apart from each other.

        Returns:
            a symmetric matrix whose rows sum to zero.

        Raises:
            FieldError: a contact overlaps another or the edge.
        """
        from .field_coupling import admittance
        from .field_disc import Disc
        from .field_model import FieldModel
        from .field_sheet import SectorSheet

        touching = [contact for contact in contacts if contact.conductance > 0.0]
        if not touching:
            return Ladder().admittance(sensor, [])
        sheet = SectorSheet.of_frustum(sensor.frustum)
        model = FieldModel(sheet, sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, self.tolerance)
        discs = []
        for contact in touching:
            radius = contact.radius or self.radius
            discs.append(Disc(contact.u, contact.phi, radius, contact.conductance / (math.pi * radius * radius)))
        y = admittance(model.discs(discs), sheet, sensor.upper_sheet_ohms, sensor.lower_sheet_ohms)[0]
        return tuple(tuple(float(value) for value in row) for row in y)
