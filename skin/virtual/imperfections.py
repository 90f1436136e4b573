"""Imperfections of a virtual sensor: what distinguishes it from its drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.core.errors import SensorError

from .substrate import ContactLaw, Foam

__all__ = ["Imperfections"]


@dataclass(frozen=True, slots=True)
class Imperfections:
    """The differences between a sensor and its drawing.

    Attributes:
        noise_counts: standard deviation of each count.
        settling_time: time constant with which a wire follows when the drive is switched [s]; it is read at the end of
            its phase.
        leak: conductance between the layers without any touch, spread evenly [S]; much less than the sheets conduct.
        leak_drift: its growth [S/s], as from damp.
        foam: how the substrate yields.
        layers: how the layers touch.
        supply_ratio: actual over nominal supply.
        clock_ratio: speed of the device clock over true time.

    Raises:
        SensorError: settling_time, noise_counts or a conductance is negative, or larger than any can be.
    """

    noise_counts: float = 0.7
    settling_time: float = 2e-6
    leak: float = 0.0
    leak_drift: float = 0.0
    foam: Foam = field(default_factory=Foam)
    layers: ContactLaw = field(default_factory=ContactLaw)
    supply_ratio: float = 1.0
    clock_ratio: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.settling_time) and self.settling_time >= 0.0):
            raise SensorError(f"settling_time must be finite and not negative, got {self.settling_time!r} s")
        for name, unit, high in (("noise_counts", "counts", 1e5), ("leak", "S", 1e3), ("leak_drift", "S/s", 1e3)):
            if not 0.0 <= (value := getattr(self, name)) <= high:
                raise SensorError(f"{name} must be from 0 to {high:g} {unit}, got {value!r} {unit}")
