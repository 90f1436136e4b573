"""Ladders of ideal resistors for the sheets: the quick contact model of the virtual skin.

Each contact divides the upper sheet at its radial fraction and the lower sheet at its angular fraction into resistors
in series, and joins the two at these nodes. Current that spreads sideways around a small contact is left out; the
resistance of that spreading counts as part of the contact's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from coneskin.core.errors import SensorError
from coneskin.skin.sensor import Sensor

from .circuit import ContactModel, LayerContact, Matrix, join

_A, _B, _C, _D = range(4)
_MIN_PART = 1e-6  # part of a sheet between two nodes, so that nodes may coincide


class ResistorLadder:
    """Contact model of ideal series and parallel resistors."""

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return the matrix of each scene; see ``admittance``."""
        return [self.admittance(sensor, contacts) for contacts in scenes]

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Do nothing: nothing takes long here."""

    def admittance(self, sensor: Sensor, contacts: Sequence[LayerContact]) -> Matrix:
        """Return the 4 x 4 matrix Y [S] in the order A, B, C, D: symmetric, its rows sum to zero.

        Raises:
            SensorError: a contact lies off the sensor, or its conductance is negative.
        """
        size = 4 + 2 * len(contacts)
        y = [[0.0] * size for _ in range(size)]
        along = [(0.0, _B), (1.0, _A)]
        around = [(0.0, _D), (1.0, _C)]
        cone = sensor.frustum
        for k, contact in enumerate(contacts):
            if not (0.0 <= contact.u <= cone.slant and 0.0 <= contact.phi <= cone.wrap):
                raise SensorError(
                    f"a contact must lie on {sensor.name}: u in [0, {cone.slant:g}] m and phi in [0, {cone.wrap:g}] "
                    f"rad, got {contact.u!r} m and {contact.phi!r} rad"
                )
            if not contact.conductance >= 0.0:
                raise SensorError(f"contact.conductance must not be negative, got {contact.conductance!r} S")
            radial, angular = sensor.fractions(contact.u, contact.phi)
            upper, lower = 4 + 2 * k, 5 + 2 * k
            along.append((1.0 - radial if sensor.b_positive else radial, upper))
            around.append((angular if sensor.c_positive else 1.0 - angular, lower))
            join(y, upper, lower, contact.conductance)
        for ladder, ohms in ((along, sensor.radial_ohms), (around, sensor.angular_ohms)):
            ladder.sort()
            for (start, j), (stop, k) in pairwise(ladder):
                join(y, j, k, 1.0 / (ohms * max(stop - start, _MIN_PART)))
        for node in range(size - 1, 3, -1):  # star-mesh: leave the inner nodes out one by one
            _eliminate(y, node)
        return tuple(tuple(row[:4]) for row in y[:4])


def _eliminate(y: list[list[float]], node: int) -> None:
    row = y[node]
    own = row[node]
    for j in range(node):
        if row[j]:
            factor = row[j] / own
            for k in range(node):
                y[j][k] -= factor * row[k]


RIGHT_WIRES = "ABCD"


def wire_order(wires: str) -> tuple[int, ...]:
    """Return the index of the electrode on each terminal, for wires such as "BACD": terminal A has electrode B.

    Raises:
        SensorError: the letters are not A, B, C and D, each once.
    """
    if sorted(wires) != list(RIGHT_WIRES):
        raise SensorError(f'wires must be the letters A, B, C, D, each once, as in "BACD", got {wires!r}')
    return tuple(RIGHT_WIRES.index(letter) for letter in wires)


def reorder(sheets: Matrix, order: Sequence[int]) -> Matrix:
    """Return what the terminals see of the electrodes: the matrix [S] with its rows and columns exchanged."""
    return tuple(tuple(sheets[i][j] for j in order) for i in order)


class RewiredSheets:
    """Contact model whose electrodes are on other terminals, by wires as in ``wire_order``."""

    def __init__(self, model: ContactModel, wires: str) -> None:
        self._model = model
        self._order = wire_order(wires)

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene of contacts the matrix Y [S] as the terminals A, B, C, D see it."""
        return [reorder(sheets, self._order) for sheets in self._model.admittances(sensor, scenes)]

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute beforehand what would take long when the sensor is touched there."""
        self._model.prepare(sensor, contact)
