"""Population of boards: parts within their data sheets, curves, cables and warmth; what the guard says of each.

Each board is a network of nine nodes with values drawn from the limits of parts.toml, solved for each temperature; no
formula of a decoder is used. Its frames go to a detector that knows the nominal values only. First a run at the
board's rate: ready, then three touches. Then an hour in frames of 10 s while the board, the sheets and what leaks in
them warm up by 10 to 40 K, with touches at the end. What the guard follows has then a thousandth of the frames that it
has; so the sheets' own resistance grows by 0.02 % a kelvin only, not by 0.1: in truth the guard follows it in 10 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.electronics import SENSE_GAIN
from coneskin.skin.firmware.board_circuit import BoardCircuit, _switch_for, board_circuit
from coneskin.skin.firmware.boards import part_catalog
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, frame_of
from coneskin.skin.virtual.field_contacts import FieldContacts

Array = NDArray[np.float64]
FOREARM = Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350)))
TOUCHES = ((0.13, 1.57), (0.06, 4.2), (0.20, 5.4))  # u [m], phi [rad]
SHEETS = (0.9, 1.0, 1.1)  # resistance over nominal
HOUR_PERIOD = 10.0  # s
NEAR = 3e-3  # m
_PHASES = ("rrpp", "gr..", "..rg")
_NAMES = (
    *("touch_c", "touch_d", "touch_current", "radial_c", "radial_d", "radial_current", "angular_a", "angular_b"),
    *("angular_current", "touch_supply", "radial_supply", "angular_supply"),
)
Curve = Callable[[Array], Array]  # of a converter: volts at its input -> volts that its counts stand for


@dataclass(frozen=True)
class Verdict:
    """What became of one board."""

    ready: bool
    error: float  #: of the worst touch [m]; infinite where one was not placed
    faults: tuple[str, ...]  #: names, in the order in which they came
    cause: dict[str, float] = field(default_factory=dict)  #: the board's own values

    @property
    def good(self) -> bool:
        """Ready, placed, and no fault at all."""
        return self.ready and self.error <= NEAR and not self.faults


@cache
def sheets_of(sensor: Sensor, ratio: float) -> Array:
    """Return the four-ports of the untouched sensor and of each touch, for sheets of another resistance [S]."""
    other = replace(
        sensor, upper_sheet_ohms=ratio * sensor.upper_sheet_ohms, lower_sheet_ohms=ratio * sensor.lower_sheet_ohms
    )
    scenes: list[list[LayerContact]] = [[], *([LayerContact(u, phi, 2.5e-3, 0.004, 0.004)] for u, phi in TOUCHES)]
    return np.array(FieldContacts().admittances(other, scenes))


@cache
def _circuit(name: str, converter: str) -> BoardCircuit:
    return board_circuit(name, FOREARM, converter)


def _drawn(rng: np.random.Generator, pair: list[float]) -> float:
    """A value within +- the worst of a pair, a third of it as deviation."""
    return float(np.clip(rng.normal(0.0, pair[1] / 3.0), -pair[1], pair[1]))


def volts_seen(circuit: BoardCircuit, rng: np.random.Generator, offset: float | None) -> Any:
    """Draw a board; return what turns scenes and temperatures into potentials at its converter, and its values."""
    catalog = part_catalog()
    limits = {name: table["limits"] for name, table in catalog.items()}
    parts = circuit.sensor.electronics
    switch = _switch_for(circuit.sensor)[1]
    precise = limits["precise"]["error_percent"]
    length = rng.uniform(0.3, 3.0)
    wire = length * 0.145 + rng.uniform(0.2, 1.2, 4)  # with bead, plug and foil
    on = (
        rng.uniform(0.7 * switch["on_ohm"][0], switch["on_ohm"][1])
        + rng.uniform(-1, 1, (2, 4)) * switch["match_ohm"][1]
    )
    pin = rng.uniform(20.0, 40.0)
    pull = circuit.pulldown_ohms * (1.0 + 0.01 * rng.uniform(-1, 1, 2) * precise[1])
    load = parts.input_ohms * (1.0 + 0.01 * rng.uniform(-1, 1, 4) * precise[1])
    shunt = circuit.shunt_ohms * (1.0 + 0.01 * _drawn(rng, limits["resistor"]["error_percent"]))
    gain = SENSE_GAIN * (1.0 + 0.01 * _drawn(rng, limits["amplifier"]["gain_percent"]))
    amplifier = _drawn(rng, limits["amplifier"]["offset_uv"]) * 1e-6 if offset is None else offset
    three = 3.3 * (1.0 + 0.015 * rng.uniform(-1, 1))
    highest = three - 1e-3 * limits["amplifier"]["swing_mv"][1]
    supply = parts.supply_volts * (1.0 + 0.01 * _drawn(rng, limits["regulator"]["error_percent"]))
    bias = parts.current_zero / 3.3 * SENSE_GAIN * circuit.shunt_ohms * three
    own = limits[circuit.converter.name if circuit.converter else circuit.board.name].get("leak_na", [0.0, 0.0])[1]
    own += limits["multiplexer"]["leak_na"][1] if circuit.board.common else 0.0
    leak = 1e-9 * 10 ** rng.uniform(-1.5, 0.0, 4) * (limits["clamp"]["leak_na"][1] + 2.0 * switch["leak_na"][1] + own)
    signs = rng.choice((-1.0, 1.0), 4)
    drift = rng.uniform(-1, 1) * limits["regulator"]["drift_ppm_per_k"][1] * 1e-6
    values = {"cable": length, "offset_uv": 1e6 * amplifier, "switch": float(on.mean()), "leak_na": 1e9 * leak.max()}

    def volts(sheets: Array, warmth: Array) -> Array:
        """Potentials of the twelve readings for four-ports and temperatures over 25 C, shape (n, 12)."""
        count = len(warmth)
        out = np.empty((count, 12))
        power = supply * (1.0 + drift * warmth)
        leaked = signs * leak * 2.0 ** ((warmth[:, None] - 35.0) / 10.0)  # the data sheet's worst is that of 60 C
        for number, phase in enumerate(_PHASES):
            g, source = np.zeros((count, 9, 9)), np.zeros((count, 9))

            def join(i: int, j: int | None, siemens: Any, g: Array = g) -> None:
                g[:, i, i] += siemens
                if j is not None:
                    g[:, j, j] += siemens
                    g[:, i, j] -= siemens
                    g[:, j, i] -= siemens

            g[:, :4, :4] += sheets
            for k, drive in enumerate(phase):
                join(k, 4 + k, 1.0 / (wire[k] * (1.0 + 0.0039 * warmth)))
                join(k, None, 1.0 / load[k])
                if drive in "rg":
                    closed = 1.0 / (on[int(drive == "g"), k] * (1.0 + 0.004 * warmth))
                    join(4 + k, 8 if drive == "r" else None, closed)
                if drive == "p":
                    join(4 + k, None, 1.0 / (pull[k - 2] + pin * (1.0 + 0.003 * warmth)))
            source[:, :4] += leaked
            join(8, None, 1.0 / shunt)
            source[:, 8] += power / shunt
            at = np.linalg.solve(g, source[..., None])[..., 0]
            first, second = ((2, 3), (2, 3), (0, 1))[number]
            out[:, 3 * number], out[:, 3 * number + 1] = at[:, first], at[:, second]
            out[:, 3 * number + 2] = np.minimum(gain * (power - at[:, 8] + amplifier) + bias, highest)
            out[:, 9 + number] = at[:, 8]
        return out

    return volts, values, three


def curve_of(circuit: BoardCircuit, rng: np.random.Generator, three: float) -> tuple[Curve, float]:
    """Draw the converter of a board: offset, gain and bend within its data sheet; its reference is 3.3 V or its own.

    Returns:
        the curve, and how far it bends [V].
    """
    parts, other = circuit.sensor.electronics, circuit.converter
    limits = part_catalog()[other.name if other else circuit.board.name]["limits"]
    bits = other.bits if other else circuit.board.bits
    lsb = parts.adc_volts / (1 << bits)
    offset, gain = lsb * _drawn(rng, limits["offset_lsb"]), 1.0 + 0.01 * _drawn(rng, limits["gain_percent"])
    bend = lsb * limits["curve_lsb"][1] * rng.uniform(0.3, 1.0)
    turns, where = rng.uniform(1.0, 4.0), rng.uniform(0.0, 6.3)
    scale = gain * (1.0 if other else parts.adc_volts / three)

    def read(volts: Array) -> Array:
        return volts * scale + offset + bend * np.sin(where + 2.0 * math.pi * turns * volts / parts.adc_volts)

    return read, bend


def esp32_curve(rng: np.random.Generator) -> Curve:
    """Draw the converter of an ESP32 at 11 dB: nothing below .14 V, slope and bend of per cents, full at 3.1 V."""
    dead, top = rng.uniform(0.10, 0.16), rng.uniform(2.95, 3.2)

    def read(volts: Array) -> Array:
        part = np.clip((volts - dead) / (top - dead), 0.0, 1.0)
        return 3.3 * (part + 0.04 * part**4 * (1.0 - part) + 0.01 * np.sin(3.0 * part))

    return read


def frames_of(
    circuit: BoardCircuit, seen: Array, period: float, rng: np.random.Generator, mains: float, noise: float
) -> Iterator[tuple[float, Any]]:
    """Turn what the converter reads into frames, with mains on the guides, noise [counts], rounding and times [s]."""
    parts = circuit.sensor.electronics
    full = parts.full_count
    counts = seen * full / parts.adc_volts
    guides = [0, 1, 3, 4, 6, 7]
    phases = rng.uniform(0.0, 2.0 * math.pi, (len(seen), 1))
    counts[:, guides] += mains * full / parts.adc_volts * np.sin(phases)
    counts = np.clip(np.rint(counts + rng.normal(0.0, noise, counts.shape)), 0, full).astype(int)
    for number, row in enumerate(counts.tolist()):
        time = period * (number + 1)
        head = (40, 0, 0, 0, number & 0xFFFF, int(1e6 * time) & 0xFFFFFFFF)
        yield time, frame_of(head, dict(zip(_NAMES, row, strict=True)))


def judge(
    name: str, converter: str, seed: int, *, offset: float | None = None, esp32: bool = False, hour: bool = True
) -> Verdict:
    """Draw a board, let it run, and say what became of it.

    Args:
        name: of the board.
        converter: that it has.
        seed: of its parts.
        offset: of its amplifier [V]; drawn by default.
        esp32: its converter is that of an ESP32.
        hour: run the hour as well.
    """
    rng = np.random.default_rng([seed, *name.encode(), *converter.encode()])
    circuit = _circuit(name, converter)
    sensor = circuit.sensor
    volts, values, three = volts_seen(circuit, rng, offset)
    read, bend = (esp32_curve(rng), 0.0) if esp32 else curve_of(circuit, rng, three)
    sheets = sheets_of(FOREARM, SHEETS[int(rng.integers(3))])
    mains, noise = rng.uniform(0.0, 5e-3), rng.uniform(0.5, 1.5)
    warming, per_kelvin = rng.uniform(10.0, 40.0), rng.uniform(-2e-4, 2e-4)
    values |= {"curve_mv": 1e3 * bend, "mains_mv": 1e3 * mains, "warming_k": warming}
    faults: list[str] = []
    errors: list[float] = []

    def play(scenes: list[int], warmth: Array, period: float) -> bool:
        detector, ready, placed = Detector(sensor), False, {}
        ports = sheets[scenes] * (1.0 / (1.0 + per_kelvin * warmth))[:, None, None]
        for (time, frame), scene in zip(
            frames_of(circuit, read(volts(ports, warmth)), period, rng, mains, noise), scenes, strict=True
        ):
            faults.extend(e.fault.name for e in detector.feed(frame, time) if isinstance(e, SkinFault))
            ready = ready or detector.ready
            if scene and detector.reading_now is not None:
                placed[scene] = detector.reading_now
        for scene in {*scenes} - {0}:
            u, phi = TOUCHES[scene - 1]
            at = placed.get(scene)
            errors.append(math.hypot(at.u - u, 0.0375 * (at.phi - phi)) if at else math.inf)
        return ready

    scenes = [0] * 150
    for touch in (1, 2, 3):
        scenes += [touch] * 12 + [0] * 20
    ready = play(scenes, np.full(len(scenes), rng.uniform(-10.0, 10.0)), 0.005)
    if hour and ready:
        times = np.arange(364) * HOUR_PERIOD
        scenes = [0] * 346 + [1] * 3 + [0] * 6 + [2] * 3 + [0] * 6
        play(scenes, warming * (1.0 - np.exp(-times / 900.0)), HOUR_PERIOD)
    return Verdict(ready, max(errors), tuple(dict.fromkeys(faults)), values)
