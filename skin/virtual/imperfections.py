"""Imperfections of a virtual sensor: how the foam yields, how the layers touch, noise, leak, clock and supply.

The foam under the upper layer is a standard linear solid: a part of its give comes at once, the rest with a relaxation
time. The layers meet when it has given as much as the threshold force (0.5 N in the paper, section 4.2) presses it in
the end. Beyond, a round body touches over a radius that grows with the cube root of the force (Hertz), and the
conductance per area grows with the pressure, as of any rough layer. Plain floats: the virtual skin asks three times a
frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from coneskin.core.errors import SensorError


class _RoundContact(NamedTuple):
    """A round contact between the layers."""

    radius: float  #: [m]; 0 where the layers do not touch
    conductance: float  #: per area [S/m^2]

    @property
    def siemens(self) -> float:
        """Conductance of the whole contact, spreading in the sheets not included [S]."""
        return self.conductance * math.pi * self.radius * self.radius


@dataclass(frozen=True, slots=True)
class Foam:
    """A viscoelastic substrate, a standard linear solid.

    Raises:
        SensorError: a value out of range.
    """

    relaxation_time: float = 0.02  #: of the delayed part at constant force [s]
    delayed: float = 0.5  #: part of the final give that comes late, 0 to below 1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.relaxation_time) and self.relaxation_time > 0.0):
            raise SensorError(f"relaxation_time must be finite and above 0 s, got {self.relaxation_time!r} s")
        if not 0.0 <= self.delayed < 1.0:
            raise SensorError(f"delayed must be in [0, 1), got {self.delayed!r}")

    def advance(self, state: float, force: float, time: float, slope: float = 0.0) -> float:
        """Return the delayed part's state [N] after a force has acted that stays or changes evenly; exact for any step.

        Args:
            state: before; 0 at rest.
            force: on the skin at the beginning [N].
            time: for how long [s]; may be infinite where the force stays.
            slope: of the force [N/s].
        """
        grown, lag = slope * time if slope else 0.0, slope * self.relaxation_time
        return force + grown - lag + (state - force + lag) * math.exp(-time / self.relaxation_time)

    def advance_swing(self, state: float, mean: float, swing: float, rate: float, angle: float, time: float) -> float:
        """Return the same while the force is mean - swing cos(angle + rate t), t from 0 to time; exact too.

        Args:
            state: before [N].
            mean: of the force [N].
            swing: of the force [N].
            rate: [rad/s], of either sign.
            angle: at the beginning [rad].
            time: for how long [s].
        """
        lag = rate * self.relaxation_time

        def follows(at: float) -> float:
            return mean - swing * (math.cos(at) + lag * math.sin(at)) / (1.0 + lag * lag)

        left = math.exp(-time / self.relaxation_time)
        return follows(angle + rate * time) + (state - follows(angle)) * left

    def seated(self, state: float, force: float) -> float:
        """Return the force that would in the end press the foam as far as it is now [N]."""
        return force + self.delayed * (state - force)


@dataclass(frozen=True, slots=True)
class ContactLaw:
    """The contact of the two layers under a force.

    Attributes:
        threshold_force: at which they meet [N]; the paper measured 0.5 N.
        radius_at_newton: radius of the contact at 1 N above that [m].
        conductance_at_newton: per area at 1 N above the threshold [S/m^2]; with the radius, 1 kohm for the contact.
        pressure_exponent: conductance per area ~ pressure^this; 0.95 for elastic rough contact.

    Raises:
        SensorError: a value is negative or not finite.
    """

    threshold_force: float = 0.5
    radius_at_newton: float = 4e-3
    conductance_at_newton: float = 20.0
    pressure_exponent: float = 0.95

    def __post_init__(self) -> None:
        for name in ("threshold_force", "radius_at_newton", "conductance_at_newton", "pressure_exponent"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SensorError(f"{name} must be finite and not negative, got {value!r}")

    def touch(self, force: float, radius: float = 0.0) -> _RoundContact:
        """Return the contact under a seated force.

        Args:
            force: [N].
            radius: of a flat body's face [m]; 0 for a round body, whose contact grows.
        """
        beyond = force - self.threshold_force
        if not beyond > 0.0:
            return _RoundContact(0.0, 0.0)
        if radius == 0.0:
            radius = self.radius_at_newton * math.cbrt(beyond)
        pressure = beyond * (self.radius_at_newton / radius) ** 2  # over that at 1 N
        return _RoundContact(radius, self.conductance_at_newton * pressure**self.pressure_exponent)


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
        current_gain: what each drive current reads over what it is.
        current_offset: of the amplifier that reads the drive current, as a part of full scale.
        offset_counts: of every reading.
        mains_volts: amplitude of 50 Hz on the guides [V].
        warming: growth of the resistance of the upper and of the lower sheet, as by temperature [1/s].

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
    current_gain: float = 1.0
    current_offset: float = 0.0
    offset_counts: float = 0.0
    mains_volts: float = 0.0
    warming: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.settling_time) and self.settling_time >= 0.0):
            raise SensorError(f"settling_time must be finite and not negative, got {self.settling_time!r} s")
        for name, unit, high in (("noise_counts", "counts", 1e5), ("leak", "S", 1e3), ("leak_drift", "S/s", 1e3)):
            if not 0.0 <= (value := getattr(self, name)) <= high:
                raise SensorError(f"{name} must be from 0 to {high:g} {unit}, got {value!r} {unit}")
