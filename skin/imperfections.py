"""What distinguishes a virtual sensor from its drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.errors import SensorError

from .substrate import Foam, Layers

__all__ = ["Imperfections"]


@dataclass(frozen=True, slots=True)
class Imperfections:
    """What distinguishes a sensor from its drawing.

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
        SensorError: settling_time is negative or not finite.
    """

    noise_counts: float = 0.7
    settling_time: float = 2e-6
    leak: float = 0.0
    leak_drift: float = 0.0
    foam: Foam = field(default_factory=Foam)
    layers: Layers = field(default_factory=Layers)
    supply_ratio: float = 1.0
    clock_ratio: float = 1.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.settling_time) and self.settling_time >= 0.0):
            raise SensorError(f"settling_time must be finite and not negative, got {self.settling_time!r} s")
