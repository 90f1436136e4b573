"""The virtual skin: a script of touches becomes the very bytes that a real sensor would send.

The chain is a device's own: force -> foam, which yields late -> contact of the layers: its radius and conductance ->
field in the sheets -> potentials and currents at the converter in each of the three phases -> settling, drift, noise,
counts -> frame -> bytes -> a line with faults. The same seed gives the same bytes.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from coneskin.errors import SensorError

from .circuit import Contact, ContactModel, Matrix, Volts, measure
from .faults import Faults, FaultyLine
from .imperfections import Imperfections
from .scripted_touch import ScriptedTouch
from .sensor import Sensor
from .wire import VERSION, Frame

__all__ = ["MODELS", "VirtualSkin"]

MODELS = ("field", "ladder")
_CURRENTS = (2, 5, 8)  # places of the drive currents in Volts
_FORCE_DIGITS = 6  # of a seated force in newtons: far below a count, and a relaxing touch comes to rest
_AHEAD = 8  # frames that are solved at once while touches change
# Conductance of 1 S spread evenly over the rectangle of the field: the mean of f f^T, f = (x, 1 - x, -y, y - 1)
_SPREAD = (
    (1 / 3, 1 / 6, -1 / 4, -1 / 4),
    (1 / 6, 1 / 3, -1 / 4, -1 / 4),
    (-1 / 4, -1 / 4, 1 / 3, 1 / 6),
    (-1 / 4, -1 / 4, 1 / 6, 1 / 3),
)


class _Placed(NamedTuple):
    """A touch of the script, and the radius that its contact will have at its firmest [m]."""

    touch: ScriptedTouch
    reach: float


_Scenes = tuple[tuple[Contact, ...], ...]  # the contacts in each phase of a frame


class VirtualSkin:
    """One virtual device with any number of sensors.

    Args:
        sensors: its sensors; they are measured one after the other.
        touches: the script; more may be added while it runs, with ``touch``.
        rate_hz: frames per second of each sensor.
        seed: of noise and of random damage.
        imperfections: noise, drift, contact law.
        faults: what goes wrong.
        model: how the sheets look from their electrodes: "field", exactly (needs numpy and scipy), "ladder", as ideal
            resistors, or a model of your own.
        duration: when the device goes away [s]; infinite by default.

    Raises:
        SensorError: no sensor, a rate that is not positive, an unknown model, or a touch of a sensor that is not here.
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
        model: ContactModel | str = "field",
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
        self.model = _model(model) if isinstance(model, str) else model
        self.duration = duration
        self._touches: dict[str, list[_Placed]] = {sensor.name: [] for sensor in self.sensors}
        self._ahead: dict[str, list[tuple[_Scenes, list[Matrix]]]] = {}
        self._measured: dict[str, tuple[object, Volts]] = {}
        for sensor in self.sensors:  # so that the first touch does not wait for what is loaded on first use
            self.model.prepare(sensor, Contact(0.5 * sensor.frustum.slant, 0.5 * sensor.frustum.wrap, 1e-3))
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
        layers = self.imperfections.layers
        firmest = layers.touch(touch.force, touch.radius)
        if firmest.siemens > 0.0:
            self.model.prepare(sensor, Contact(touch.u, touch.phi, firmest.siemens, firmest.radius, firmest.radius))
        self._touches[name].append(_Placed(touch, firmest.radius))

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
        """What stands at the converter; the newest answer is kept, because a touch mostly rests."""
        scenes = tuple(self._contacts(sensor, time) for time in times)
        leaks = tuple(self.imperfections.leak + self.imperfections.leak_drift * time for time in times)
        wiring = self.faults.wiring_at(index)
        key = (scenes, leaks, wiring)
        known = self._measured.get(sensor.name)
        if known is None or known[0] != key:
            sheets = [_leaking(y, leak) for y, leak in zip(self._sheets(sensor, scenes, times), leaks, strict=True)]
            known = (key, measure(sensor, sheets, wiring))
            self._measured[sensor.name] = known
        return known[1]

    def _sheets(self, sensor: Sensor, scenes: _Scenes, times: Sequence[float]) -> list[Matrix]:
        """The sheets of one frame. While touches change, the next frames are solved with it, which costs little more.

        A touch that is added later makes those frames other ones, and they are solved again.
        """
        ahead = self._ahead.setdefault(sensor.name, [])
        while ahead and ahead[0][0] != scenes:
            ahead.pop(0)
        if not ahead:
            frames = [scenes]
            for number in range(1, _AHEAD):
                later = tuple(self._contacts(sensor, time + number / self.rate_hz) for time in times)
                if later == frames[-1]:
                    break
                frames.append(later)
            solved = self.model.admittances(sensor, [scene for frame in frames for scene in frame])
            ahead += [(frame, solved[3 * number : 3 * number + 3]) for number, frame in enumerate(frames)]
        return ahead[0][1]

    def _contacts(self, sensor: Sensor, time: float) -> tuple[Contact, ...]:
        """Where the layers touch at a time."""
        foam, layers = self.imperfections.foam, self.imperfections.layers
        contacts = []
        for touch, reach in self._touches[sensor.name]:
            seated = round(touch.seated_at(time, foam), _FORCE_DIGITS)
            if seated > layers.threshold_force:
                contact = layers.touch(seated, touch.radius)
                contacts.append(Contact(touch.u, touch.phi, contact.siemens, contact.radius, reach))
        return tuple(contacts)

    def _convert(self, sensor: Sensor, volts: Volts, rng: random.Random) -> list[int]:
        """Settling, noise and rounding."""
        real, parts = self.imperfections, sensor.electronics
        values = list(volts)
        if real.settling_time:
            left_over = math.exp(-1.0 / (3.0 * self.rate_hz * len(self.sensors) * real.settling_time))
            supply = parts.supply_volts
            at_c, at_d = (supply, 0.0) if sensor.c_positive else (0.0, supply)
            rest = (at_c, at_d, volts.touch_c, volts.touch_d)  # the wires' potentials one phase before
            for place, left in zip((0, 1, 3, 4), rest, strict=True):
                values[place] += left_over * (left - values[place])
            at_a, at_b = (0.0, supply) if sensor.b_positive else (supply, 0.0)
            for place, left in zip((6, 7), (at_a, at_b), strict=True):
                values[place] += left_over * (left - values[place])
        full, counts = parts.full_count, []
        volt, ampere = full / parts.adc_volts * real.supply_ratio, full / parts.current_full_scale * real.supply_ratio
        for place, value in enumerate(values):
            count = value * (ampere if place in _CURRENTS else volt)
            if real.noise_counts:
                count += rng.gauss(0.0, real.noise_counts)
            counts.append(min(max(round(count), 0), full))
        return counts


def _model(name: str) -> ContactModel:
    if name == "field":
        from .field_contact import FieldContacts

        return FieldContacts()
    if name == "ladder":
        from .ladder import Ladder

        return Ladder()
    raise SensorError(f"the model of a virtual skin must be one of {', '.join(MODELS)}, got {name!r}")


def _leaking(sheets: Matrix, leak: float) -> Matrix:
    if leak <= 0.0:
        return sheets
    return tuple(
        tuple(y + leak * part for y, part in zip(row, parts, strict=True))
        for row, parts in zip(sheets, _SPREAD, strict=True)
    )
