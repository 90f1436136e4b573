"""Virtual skin: turns a script of touches into the very bytes that a real sensor would send.

The chain is a device's own: force -> foam, which yields late -> contact of the layers: its radius and conductance ->
field in the sheets -> potentials and currents at the converter in each of the three phases -> settling, drift, noise,
counts -> frame -> bytes -> a line with faults. The same seed gives the same bytes.
"""

from __future__ import annotations

import math
import random
from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from coneskin.core.errors import SensorError
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTH, FRAME_LENGTHS, Frame

from .circuit import (
    RIGHT_WIRES,
    ContactModel,
    ConverterInputs,
    LayerContact,
    Matrix,
    ResistorLadder,
    RewiredSheets,
    frame_of,
    join,
    measure,
)
from .fault_injection import FaultInjection, FaultyLine
from .imperfections import Imperfections
from .scripted_touch import PlacedTouch, ScriptedTouch, across_seam

MODELS = ("field", "ladder")
_CURRENT_NAMES = frozenset({"touch_current", "radial_current", "angular_current"})  # the rest are potentials
_GUIDE_NAMES = frozenset({"touch_c", "touch_d", "radial_c", "radial_d", "angular_a", "angular_b"})
_MAINS_RATE = 2.0 * math.pi * 50.0  # rad/s
_FORCE_DIGITS = 6  # decimals of a force [N]: far below a count, and a relaxing touch comes to rest
_MAX_RATE = 1e6  # Hz; frames of a microsecond, the unit of the device clock
_FRAMES_AHEAD = 8  # frames; solved at once while touches change
# Conductance of 1 S spread evenly over the rectangle of the field: the mean of f f^T, f = (x, 1 - x, -y, y - 1)
_LEAK_MATRIX = (
    (1 / 3, 1 / 6, -1 / 4, -1 / 4),
    (1 / 6, 1 / 3, -1 / 4, -1 / 4),
    (-1 / 4, -1 / 4, 1 / 3, 1 / 6),
    (-1 / 4, -1 / 4, 1 / 6, 1 / 3),
)


_Scenes = tuple[tuple[LayerContact, ...], ...]  # the contacts in each phase of a frame


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
        frame_length: bytes of its frames: 36 with one supply, 40 with that of each phase, 52 with the driven
            electrodes' own potentials as well.
        wires: electrodes on the terminals A, B, C, D; another order is a wrong wiring.

    Raises:
        SensorError: no sensor, a rate that is not positive, an unknown model or length, a fault of a reading that its
            frames do not carry, or a touch of a sensor that is not here.
    """

    def __init__(
        self,
        sensors: Sensor | Sequence[Sensor],
        touches: Sequence[ScriptedTouch] = (),
        *,
        rate_hz: float = 1000.0,
        seed: int = 0,
        imperfections: Imperfections | None = None,
        faults: FaultInjection | None = None,
        model: ContactModel | str = "field",
        duration: float = math.inf,
        frame_length: int = FRAME_LENGTH,
        wires: str = RIGHT_WIRES,
    ) -> None:
        self.sensors = (sensors,) if isinstance(sensors, Sensor) else tuple(sensors)
        if not self.sensors:
            raise SensorError("a virtual skin needs at least one sensor, got none")
        if not 0.0 < rate_hz <= _MAX_RATE:
            raise SensorError(f"rate_hz must be finite and above 0 Hz, at most {_MAX_RATE:g} Hz, got {rate_hz!r} Hz")
        if not duration > 0.0:
            raise SensorError(f"duration must be above 0 s, got {duration!r} s")
        self.rate_hz, self.seed, self.duration, self.frame_length = rate_hz, seed, duration, frame_length
        self.imperfections = imperfections or Imperfections()
        self.faults = faults or FaultInjection()
        sheets = contact_model(model) if isinstance(model, str) else model
        self.model = sheets if wires == RIGHT_WIRES else RewiredSheets(sheets, wires)
        self._channels = _channels(frame_length)
        stuck = self.faults.stuck_channel
        one_supply = frame_length == FRAME_LENGTH
        if stuck not in (*self._channels, "supply", "all") or (one_supply and stuck == "touch_supply"):
            raise SensorError(
                f"faults.stuck_channel {stuck} is no reading of its own in these frames: see frame_length"
            )
        self._touches: dict[str, list[PlacedTouch]] = {sensor.name: [] for sensor in self.sensors}
        self._ahead: dict[str, list[tuple[_Scenes, list[Matrix]]]] = {}
        self._measured: dict[str, tuple[object, list[float]]] = {}
        for sensor in self.sensors:  # so that the first touch does not wait for what is loaded on first use
            self.model.prepare(sensor, LayerContact(0.5 * sensor.frustum.slant, 0.5 * sensor.frustum.wrap, 1e-3))
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
        firmest = self.imperfections.layers.touch(touch.firmest, touch.radius)
        placed = PlacedTouch.on(sensor, touch, firmest.radius)
        if firmest.siemens > 0.0:
            self.model.prepare(
                sensor, LayerContact(touch.u, touch.phi, firmest.siemens, firmest.radius, firmest.radius)
            )
        self._touches[name].append(placed)

    def release(self, time: float) -> None:
        """End at a time [s] every touch that has begun by then and would last longer."""
        for name, placed in self._touches.items():
            self._touches[name] = [
                item._replace(touch=item.touch.ended_at(time + item.touch.rise))
                if item.touch.start < time < item.touch.end - item.touch.rise
                else item
                for item in placed
            ]

    def frames(self) -> Iterator[tuple[float, Frame]]:
        """Measure the frames, for ever or until ``duration``.

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
                exact = self._exact_counts(sensor, (start + step, start + 2.0 * step, start + 3.0 * step), index)
                counts = self._convert(sensor.electronics, exact, rng, start)
                clock = int((start + step) * 1e6 * self.imperfections.clock_ratio) & 0xFFFFFFFF
                head = (self.frame_length, sensor.device_id, sensor.sensor_id, 0, cycle & 0xFFFF, clock)
                yield start + 3.0 * step, frame_of(head, counts)
                index += 1
            cycle += 1

    def packets(self) -> Iterator[tuple[float, bytes]]:
        """Send the frames over the faulty line.

        Yields:
            the time since the start [s], and the bytes that arrive then (none, where a fault swallows them).

        Raises:
            SkinConnectionError: the line is gone, or the device after its ``duration``.
        """
        line = FaultyLine(self.faults, self.seed)
        for time, frame in self.frames():
            yield time, line.send(frame)

    def _exact_counts(self, sensor: Sensor, times: tuple[float, float, float], index: int) -> list[float]:
        """Return the counts without noise and rounding; the newest result is kept, because a touch mostly rests."""
        scenes = tuple(self._contacts(sensor, time) for time in times)
        leaks = tuple(self.imperfections.leak + self.imperfections.leak_drift * time for time in times)
        wiring = self.faults.wiring_at(index)
        warm = self.imperfections.warming
        grown = (warm[0] * times[0], warm[1] * times[0]) if any(warm) else warm
        key = (scenes, leaks, wiring, grown)
        known = self._measured.get(sensor.name)
        if known is None or known[0] != key:
            dry = zip(self._sheets(sensor, scenes, times), leaks, strict=True)
            sheets = [_warmed(_leaking(y, leak), sensor, grown) for y, leak in dry]
            known = (key, self._amplify(sensor, measure(sensor, sheets, wiring)))
            self._measured[sensor.name] = known
        return known[1]

    def _sheets(self, sensor: Sensor, scenes: _Scenes, times: Sequence[float]) -> list[Matrix]:
        """Solve the sheets of one frame; while touches change, also of the next ones, at little extra cost.

        A touch that is added later makes those frames other ones, and they are solved again.
        """
        ahead = self._ahead.setdefault(sensor.name, [])
        while ahead and ahead[0][0] != scenes:
            ahead.pop(0)
        if not ahead:
            frames = [scenes]
            for number in range(1, _FRAMES_AHEAD):
                later = tuple(self._contacts(sensor, time + number / self.rate_hz) for time in times)
                if later == frames[-1]:
                    break
                frames.append(later)
            solved = self.model.admittances(sensor, [scene for frame in frames for scene in frame])
            ahead += [(frame, solved[3 * number : 3 * number + 3]) for number, frame in enumerate(frames)]
        return ahead[0][1]

    def _contacts(self, sensor: Sensor, time: float) -> tuple[LayerContact, ...]:
        """Return the contacts between the layers at a time."""
        foam, layers = self.imperfections.foam, self.imperfections.layers
        contacts = []
        for placed in self._touches[sensor.name]:
            touch, reach = placed.touch, placed.reach
            seated = round(touch.seated_at(time, foam), _FORCE_DIGITS)
            if seated > layers.threshold_force:
                contact = layers.touch(seated, touch.radius)
                u, phi = placed.place_at(time)
                contacts.append(LayerContact(u, phi, contact.siemens, contact.radius, reach))
                beyond = across_seam(sensor.frustum, u, phi, reach)
                if beyond is not None:
                    phi, share = beyond
                    size = math.sqrt(share)
                    part = LayerContact(u, phi, share * contact.siemens, size * contact.radius, size * reach)
                    contacts.append(part)
        return tuple(contacts)

    def _amplify(self, sensor: Sensor, volts: ConverterInputs) -> list[float]:
        """Return the counts of the converter in the order of its channels: settling, gain and offset."""
        real, parts = self.imperfections, sensor.electronics
        values = volts._asdict()
        if real.settling_time:
            left_over = math.exp(-1.0 / (3.0 * self.rate_hz * len(self.sensors) * real.settling_time))
            a, b = (0.0, parts.supply_volts) if sensor.b_positive else (parts.supply_volts, 0.0)
            c, d = (parts.supply_volts, 0.0) if sensor.c_positive else (0.0, parts.supply_volts)
            before = {"touch_c": c, "touch_d": d, "radial_c": volts.touch_c, "radial_d": volts.touch_d}
            before |= {"angular_a": a, "angular_b": b}  # the wires' potentials one phase before
            for name, left in before.items():
                values[name] += left_over * (left - values[name])
        full = parts.full_count
        volt, ampere = full / parts.adc_volts * real.supply_ratio, full / parts.current_full_scale * real.supply_ratio
        zero = full * (parts.current_zero / parts.current_full_scale + real.current_offset)
        return [
            (values[name] * ampere * real.current_gain + zero if name in _CURRENT_NAMES else values[name] * volt)
            + real.offset_counts
            for name in self._channels
        ]

    def _convert(self, parts: Electronics, exact: list[float], rng: random.Random, start: float) -> dict[str, int]:
        """Return the counts by field: mains, noise and rounding."""
        real, full, counts = self.imperfections, parts.full_count, {}
        mains = real.mains_volts * math.sin(_MAINS_RATE * start) * full / parts.adc_volts * real.supply_ratio
        for name, count in zip(self._channels, exact, strict=True):
            if mains and name in _GUIDE_NAMES:
                count += mains
            if real.noise_counts:
                count += rng.gauss(0.0, real.noise_counts)
            counts[name] = min(max(round(count), 0), full)
        if self.frame_length == FRAME_LENGTH:
            counts["radial_supply"] = counts["angular_supply"] = counts["touch_supply"]
        return counts


def _channels(frame_length: int) -> tuple[str, ...]:
    """Return the readings that a frame of a length carries, in the order in which they are made."""
    if frame_length not in FRAME_LENGTHS:
        raise SensorError(f"frame_length must be one of 36, 40, 52 bytes, got {frame_length!r}")
    return ConverterInputs._fields[: (frame_length - 16) // 2]


def contact_model(name: str) -> ContactModel:
    """Return the model of a name of ``MODELS``.

    Raises:
        SensorError: there is no such model.
    """
    if name == "field":
        from .field_contacts import FieldContacts

        return FieldContacts()
    if name == "ladder":
        return ResistorLadder()
    raise SensorError(f"the model of a virtual skin must be one of {', '.join(MODELS)}, got {name!r}")


def _leaking(sheets: Matrix, leak: float) -> Matrix:
    if leak <= 0.0:
        return sheets
    return tuple(
        tuple(y + leak * part for y, part in zip(row, parts, strict=True))
        for row, parts in zip(sheets, _LEAK_MATRIX, strict=True)
    )


def _warmed(sheets: Matrix, sensor: Sensor, grown: tuple[float, float]) -> Matrix:
    """Return the sheets with resistances that have grown by these ratios; contacts conduct little beside them."""
    if not any(grown):
        return sheets
    rows = [list(row) for row in sheets]
    for first, ohms, ratio in ((0, sensor.radial_ohms, grown[0]), (2, sensor.angular_ohms, grown[1])):
        join(rows, first, first + 1, -ratio / (1.0 + ratio) / ohms)
    return tuple(tuple(row) for row in rows)


_PRESS_DIGITS = 3  # decimals of a force [N]: below a count, and a pressure that rests need not be solved again
_FINE_STEPS = 1e-5, 1e-5  # of u [m] and phi [rad]: a contact that rests within 10 um is the same
_COARSE_STEPS = 2e-4, 1e-3  # the same where time counts: the field of a new place takes 0.8 ms
_REACH_STEP = 1e-3  # m; the field of a place is solved for contacts up to a multiple of this
_FORGOTTEN_FORCE = 1e-3  # N of the foam's state from which on a body that is gone is forgotten


class Press(NamedTuple):
    """Force of one body on one sensor."""

    sensor: str  #: its name
    u: float  #: slant distance of the middle from end 1 [m]
    phi: float  #: azimuth of the middle [rad]
    force: float  #: [N]
    radius: float = 0.0  #: of a flat face [m]; 0 for a round body


class PressedSkin(VirtualSkin):
    """Virtual skin of bodies; foam and layers yield as those of any virtual skin.

    Args:
        coarse: let contacts move in steps of 0.2 mm and 1 mrad, where bytes are wanted in real time.
        options: of `VirtualSkin`, by name.
    """

    def __init__(
        self, sensors: Sequence[Sensor], touches: Sequence[ScriptedTouch] = (), *, coarse: bool = False, **options: Any
    ) -> None:
        super().__init__(sensors, touches, **options)
        self._steps = _COARSE_STEPS if coarse else _FINE_STEPS
        self._cones = {sensor.name: sensor.frustum for sensor in sensors}
        self._delayed: dict[Hashable, tuple[float, Press]] = {}  # state of the foam below each [N]
        self._now: dict[str, tuple[LayerContact, ...]] = {}

    def press(self, presses: Mapping[Any, Press], step: float) -> None:
        """Let bodies press for a time; the next frame shows what came of it.

        Args:
            presses: what presses, by what tells one body from another; a body that is not there presses no more.
            step: for how long [s].
        """
        foam, layers = self.imperfections.foam, self.imperfections.layers
        found: dict[str, list[LayerContact]] = {}
        kept: dict[Hashable, tuple[float, Press]] = {}
        gone = {body: last._replace(force=0.0) for body, (_, last) in self._delayed.items()}
        for body, press in {**gone, **presses}.items():
            before = self._delayed[body][0] if body in self._delayed else 0.0
            state = foam.advance(before, press.force, step)
            if press.force > 0.0 or state > _FORGOTTEN_FORCE:
                kept[body] = state, press
            seated = round(foam.seated(state, press.force), _PRESS_DIGITS)
            if seated > layers.threshold_force:
                contact = layers.touch(seated, press.radius)
                cone = self._cones[press.sensor]
                u, phi = _rounded(press.u, cone.slant, self._steps[0]), _rounded(press.phi, cone.wrap, self._steps[1])
                reach = _REACH_STEP * math.ceil(contact.radius / _REACH_STEP)
                item = LayerContact(u, phi, contact.siemens, contact.radius, reach)
                found.setdefault(press.sensor, []).append(item)
        self._delayed = kept
        self._now = {name: tuple(contacts) for name, contacts in found.items()}

    def _contacts(self, sensor: Sensor, time: float) -> tuple[LayerContact, ...]:
        return (*super()._contacts(sensor, time), *self._now.get(sensor.name, ()))


def _rounded(value: float, most: float, step: float) -> float:
    """Return a coordinate in steps; one at the edge stays on the sheet."""
    rounded = step * round(value / step)
    return most if value <= most < rounded else rounded
