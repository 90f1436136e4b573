"""Marks of one sensor: those to touch, and what was read at those touched already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.scene.commissioning_record import MarkResult

from .marks import Mark
from .misreadings import Place

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["SensorMarks"]


@dataclass
class SensorMarks:
    """Marks of one sensor, and what has become of them.

    Attributes:
        sensor: the sensor.
        link: on which it is.
        offered: all places that can be described.
        plan: places to touch, those touched already first.
        refused: places that a person cannot reach.
        results: of those touched.
        read: places that it read there.
        cause: why it has failed; empty where it has not.
    """

    sensor: Sensor
    link: str
    offered: Sequence[Mark]
    plan: tuple[Mark, ...] = ()
    refused: list[Mark] = field(default_factory=list)
    results: list[MarkResult] = field(default_factory=list)
    read: list[Place] = field(default_factory=list)
    cause: str = ""

    @property
    def failed(self) -> bool:
        """True once a mark was not read where it is."""
        return any(not result.passed for result in self.results)
