"""The virtual skin: a script of touches becomes the very bytes that a real sensor would send.

The chain is a device's own: force -> conductance between the layers -> potentials and currents at the converter in
each of the three phases -> settling, noise, counts -> frame -> bytes -> a line with faults. The same seed gives the
same bytes.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from coneskin.errors import SensorError

from .circuit import Contact, ContactModel, Matrix, Volts, Wiring, measure
from .faults import Faults, FaultyLine
from .ladder import Ladder
from .sensor import Sensor
from .wire import VERSION, Frame

__all__ = ["Imperfections", "ScriptedTouch", "VirtualSkin"]

_CURRENTS = (2, 5, 8)  # places of the drive currents in Volts


@dataclass(frozen=True, slots=True)
class ScriptedTouch:
    """One touch of the script.

    Attributes:
        start: when it begins [s].
        end: when it ends [s]; may be infinite.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        force: at its firmest [N].
        rise: time in which the force rises, and falls again [s].
        radius: of the contact [m]; 0 for a point.
        sensor: name of the sensor touched; empty: the first.

    Raises:
        SensorError: it ends before it begins, or a value is negative or not finite.
    """

    start: float
    end: float
    u: float
    phi: float
    force: float = 5.0
    rise: float = 0.01
    radius: float = 0.0
    sensor: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and self.end > self.start):
            raise SensorError(f"a touch must end after it starts, got {self.start!r} s to {self.end!r} s")
        for name in ("u", "phi", "force", "rise", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SensorError(f"touch.{name} must be finite and not negative, got {value!r}")

    def force_at(self, time: float) -> float:
        """Force at a time [N]: it rises and falls along half a cosine."""
        since = min(time - self.start, self.end - time)
        if since <= 0.0:
            return 0.0
        return self.force if since >= self.rise else 0.5 * self.force * (1.0 - math.cos(math.pi * since / self.rise))


@dataclass(frozen=True, slots=True)
class Imperfections:
    """What distinguishes a sensor from its drawing.

    Attributes:
        noise_counts: standard deviation of each count.
        settling: part of the previous phase's potential that is left on a wire when it is read.
        leak: conductance between the layers without any touch [S].
        leak_drift: its growth [S/s], as from damp.
        threshold_force: force at which the layers begin to touch [N]; the paper measured 0.5 N.
        siemens_per_newton: conductance of a contact for each newton above that [S/N].
        supply_ratio: actual over nominal supply.
        clock_ratio: speed of the device clock over true time.
    """

    noise_counts: float = 0.7
    settling: float = 0.0
    leak: float = 0.0
    leak_drift: float = 0.0
    threshold_force: float = 0.5
    siemens_per_newton: float = 1e-3
    supply_ratio: float = 1.0
    clock_ratio: float = 1.0

    def conductance(self, force: float) -> float:
        """Conductance of a contact under a force [N], in siemens."""
        return self.siemens_per_newton * max(0.0, force - self.threshold_force)


class VirtualSkin:
    """One virtual device with any number of sensors.

    Args:
        sensors: its sensors; they are measured one after the other.
        touches: the script; more may be added while it runs, with ``touch``.
        rate_hz: frames per second of each sensor.
        seed: of noise and of random damage.
        imperfections: noise, drift, contact law.
        faults: what goes wrong.
        model: how the sheets look from their electrodes; ideal ladders by default.
        duration: when the device goes away [s]; infinite by default.

    Raises:
        SensorError: no sensor, a rate that is not positive, or a touch of a sensor that is not here.
    """

    def __init__(
        self,
        sensors: Sensor | Sequence[Sensor],
        touches: Sequence[ScriptedTouch] = (),
        *,
        rate_hz: float = 1000.0,
        seed: int = 0,
        imperfections: Imperfections | None = None,
        faults: Faults | None = None,
        model: ContactModel | None = None,
        duration: float = math.inf,
    ) -> None:
        self.sensors = (sensors,) if isinstance(sensors, Sensor) else tuple(sensors)
        if not self.sensors:
            raise SensorError("a virtual skin needs at least one sensor, got none")
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise SensorError(f"rate_hz must be finite and above 0 Hz, got {rate_hz!r}")
        if not duration > 0.0:
            raise SensorError(f"duration must be above 0 s, got {duration!r} s")
        self.rate_hz = rate_hz
        self.seed = seed
        self.imperfections = imperfections or Imperfections()
        self.faults = faults or Faults()
        self.model = model or Ladder()
        self.duration = duration
        self._touches: dict[str, list[ScriptedTouch]] = {sensor.name: [] for sensor in self.sensors}
        self._cache: dict[str, tuple[tuple[Contact, ...], Matrix]] = {}
        self._measured: dict[str, tuple[tuple[Matrix, ...], Wiring, Volts]] = {}
        for touch in touches:
            self.touch(touch)

    def touch(self, touch: ScriptedTouch) -> None:
        """Add a touch to the script.

        Raises:
            SensorError: there is no such sensor, or the place is off it.
        """
        name = touch.sensor or self.sensors[0].name
        sensor = next((s for s in self.sensors if s.name == name), None)
        if sensor is None:
            names = ", ".join(s.name for s in self.sensors)
            raise SensorError(f"touch.sensor must be one of {names}, got {touch.sensor!r}")
        cone = sensor.frustum
        if not (touch.u <= cone.slant and touch.phi <= cone.wrap):
            raise SensorError(
                f"a touch must lie on {name}: u up to {cone.slant:g} m and phi up to {cone.wrap:g} rad, got "
                f"{touch.u!r} m and {touch.phi!r} rad"
            )
        self._touches[name].append(touch)

    def frames(self) -> Iterator[tuple[float, Frame]]:
        """The frames that the device measures, for ever or until ``duration``.

        Yields:
            the time since the start at which a frame is complete [s], and the frame.
        """
        rng = random.Random(f"noise {self.seed}")
        period = 1.0 / self.rate_hz
        step = period / (3.0 * len(self.sensors))
        index = cycle = 0
        while cycle * period < self.duration:
            for place, sensor in enumerate(self.sensors):
                start = cycle * period + 3.0 * step * place
                volts = self._volts(sensor, (start + step, start + 2.0 * step, start + 3.0 * step), index)
                counts = self._convert(sensor, volts, rng)
                clock = int((start + step) * 1e6 * self.imperfections.clock_ratio) & 0xFFFFFFFF
                head = (VERSION, sensor.device_id, sensor.sensor_id, 0, cycle & 0xFFFF, clock)
                yield start + 3.0 * step, Frame(*head, *counts)
                index += 1
            cycle += 1

    def packets(self) -> Iterator[tuple[float, bytes]]:
        """What arrives at the reader.

        Yields:
            the time since the start [s], and the bytes that arrive then (none, where a fault swallows them).

        Raises:
            SkinConnectionError: the line is gone, or the device after its ``duration``.
        """
        line = FaultyLine(self.faults, self.seed)
        for time, frame in self.frames():
            yield time, line.send(frame)

    def _volts(self, sensor: Sensor, times: tuple[float, float, float], index: int) -> Volts:
        sheets = tuple(self._sheets(sensor, time) for time in times)
        wiring = self.faults.wiring_at(index)
        known = self._measured.get(sensor.name)
        if known is not None and known[1] == wiring and all(a is b for a, b in zip(known[0], sheets, strict=True)):
            return known[2]
        volts = measure(sensor, sheets, wiring)
        self._measured[sensor.name] = (sheets, wiring, volts)
        return volts

    def _sheets(self, sensor: Sensor, time: float) -> Matrix:
        """The sheets at a time; the newest answer is kept, because a touch mostly rests."""
        real = self.imperfections
        contacts = []
        leak = real.leak + real.leak_drift * time
        if leak > 0.0:
            cone = sensor.frustum
            contacts.append(Contact(0.5 * cone.slant, 0.5 * cone.wrap, leak))
        for touch in self._touches[sensor.name]:
            conductance = real.conductance(touch.force_at(time))
            if conductance > 0.0:
                contacts.append(Contact(touch.u, touch.phi, conductance, touch.radius))
        key = tuple(contacts)
        known = self._cache.get(sensor.name)
        if known is None or known[0] != key:
            known = (key, self.model.admittance(sensor, contacts))
            self._cache[sensor.name] = known
        return known[1]

    def _convert(self, sensor: Sensor, volts: Volts, rng: random.Random) -> list[int]:
        """Settling, noise and rounding."""
        real, parts = self.imperfections, sensor.electronics
        values = list(volts)
        if real.settling:
            supply = parts.supply_volts
            at_c, at_d = (supply, 0.0) if sensor.c_positive else (0.0, supply)
            rest = (at_c, at_d, volts.touch_c, volts.touch_d)  # the wires' potentials one phase before
            for place, left in zip((0, 1, 3, 4), rest, strict=True):
                values[place] += real.settling * (left - values[place])
            at_a, at_b = (0.0, supply) if sensor.b_positive else (supply, 0.0)
            for place, left in zip((6, 7), (at_a, at_b), strict=True):
                values[place] += real.settling * (left - values[place])
        full, counts = parts.full_count, []
        volt, ampere = full / parts.adc_volts * real.supply_ratio, full / parts.current_full_scale * real.supply_ratio
        for place, value in enumerate(values):
            count = value * (ampere if place in _CURRENTS else volt)
            if real.noise_counts:
                count += rng.gauss(0.0, real.noise_counts)
            counts.append(min(max(round(count), 0), full))
        return counts
