"""Rewired sheets: any contact model with its electrodes on the wrong terminals of the electronics."""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.core.errors import SensorError
from coneskin.skin.sensor import Sensor

from .circuit import ContactModel, LayerContact, Matrix

__all__ = ["RIGHT_WIRES", "RewiredSheets", "reorder", "wire_order"]

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
    """Contact model whose electrodes are on other terminals.

    Args:
        model: of the sheets.
        wires: as in ``wire_order``.
    """

    def __init__(self, model: ContactModel, wires: str) -> None:
        self._model = model
        self._order = wire_order(wires)

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene of contacts the matrix Y [S] as the terminals A, B, C, D see it."""
        return [reorder(sheets, self._order) for sheets in self._model.admittances(sensor, scenes)]

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute beforehand what would take long when the sensor is touched there."""
        self._model.prepare(sensor, contact)
