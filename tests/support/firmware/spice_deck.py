"""Deck of ngspice from the netlist of a board, with cable and sheets, and what it says beside the virtual circuit."""

from __future__ import annotations

import math
import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from coneskin.geometry.frustum import Frustum
from coneskin.skin.firmware.board_circuit import PIN_OHMS, BoardCircuit
from coneskin.skin.firmware.boards import part_catalog
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, Matrix, measure
from coneskin.skin.virtual.field_contacts import FieldContacts

#: the forearm of a UR5e, the sector of the paper (r 100 to 200 mm, 90 deg), and the ring whose shunt is 1.3 ohm
SENSORS = {
    "UR5e forearm": Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350))),
    "paper's sector": Sensor(Frustum(0.025, 0.05, 0.1, math.tau)),
    "1.3 ohm ring": Sensor(Frustum(0.054, 0.054, 0.036, math.radians(350))),
}
BOARDS = (("pico", "built-in"), ("esp32", "ads1115"))
CABLE = 3.0  # m
SETTLE = 150e-6  # s; the sketch's usual settle_us
SWITCHING = 10e-6  # s; from the first gate of a phase to the last, as on an Uno
_UNITS = {"": 1.0, "n": 1e-9, "u": 1e-6, "p": 1e-12, "k": 1e3, "M": 1e6}
_PHASES = {  # drives of A, B, C, D: r rail, g ground, d pull-down, dot free
    "touch": "rrdd",
    "radial": "gr..",
    "angular": "..rg",
    "rest": "gggg",
}
_READS = {"touch": "CD", "radial": "CD", "angular": "AB"}


def number(value: str) -> float:
    """Return "10 kohm" as 1e4."""
    figure, unit = value.split()
    return float(figure) * _UNITS[re.sub(r"(ohm|F)$", "", unit)]


def schedule(sensor: Sensor, read_time: float, slow: float) -> tuple[list[tuple[float, str, str]], dict[str, float]]:
    """Return drives with the times at which they begin, and when each phase is first read [s].

    Args:
        sensor: for its polarity, which is the usual one here.
        read_time: of one reading [s].
        slow: factor on every dwell.
    """
    assert sensor.b_positive
    assert sensor.c_positive
    now, steps, reads = 20e-6, [(0.0, "gggg", "rest")], {}
    for phase in ("touch", "radial", "angular"):
        drives = _PHASES[phase]
        if phase != "touch":  # guides at ground while the driven sheet settles
            steps.append((now, drives.replace(".", "g"), phase))
            now += slow * SETTLE / 2 + SWITCHING
        steps.append((now, drives, phase))
        now += slow * SETTLE + SWITCHING
        reads[phase] = now
        now += 6 * read_time
    return [*steps, (now, "gggg", "rest")], reads


def deck(
    circuit: BoardCircuit,
    sheets: Matrix,
    steps: Sequence[tuple[float, str, str]],
    *,
    warm: bool = False,
    mains: float = 0.0,
) -> list[str]:
    """Return the elements of the deck: the board's components, its controller, the cable and the sheets."""
    catalog = part_catalog()
    out = ["V5 5V 0 5", "V3 3V3 0 3.3"]

    def switch(name: str, one: str, other: str, gate: str, ohms: float) -> str:
        """A conductance that follows the gate: a switch that jumps stops the integration."""
        return f"B_{name} {one} {other} I=V({one},{other})*(1e-12+V({gate})/{3.3 * ohms!r})"

    def leak(limits: dict[str, list[float]]) -> float:
        return 1e-9 * limits["leak_na"][1] if warm else 0.0

    for name, part, value, _, pins in circuit.components:
        net = {pin: at.replace("GND", "0").replace("SHIELD", "0") for pin, at in pins.items()}
        limits = catalog[part]["limits"]
        if value.endswith("ohm"):
            out.append(f"R_{name} {net['1']} {net['2']} {number(value)}")
        elif part in ("filter", "decoupling"):
            out.append(f"C_{name} {net['1']} {net['2']} {number(value)}")
        elif part == "bead":
            out.append(f"R_{name} {net['1']} {net['2']} {limits['on_ohm'][0]}")  # rings far faster than the dwell
        elif "switch" in part:
            for k in (1, 2, 3, 4):
                out.append(switch(f"{name}_{k}", net[f"D{k}"], net[f"S{k}"], net[f"SEL{k}"], limits["on_ohm"][0]))
                out.append(f"I_{name}_{k} 0 {net[f'D{k}']} {leak(limits)}")
        elif part == "clamp":
            for k in (1, 2, 3, 4):
                out.append(f"I_{name}_{k} 0 {net[f'IO{k}']} {leak(limits)}")
                out.append(f"C_{name}_{k} {net[f'IO{k}']} 0 1p")
        elif part == "amplifier":
            out.append(f"B_{name} g_{name} 0 V=50*(V({net['IN+']})-V({net['IN-']}))+V({net['REF']})")
            tau = 1.0 / (2.0 * math.pi * limits["bandwidth_hz"][1])
            out += [f"R_{name} g_{name} h_{name} 1k", f"C_{name} h_{name} 0 {1e-3 * tau}"]
            out.append(f"E_{name} {net['OUT']} 0 h_{name} 0 1")
        elif part in ("regulator", "adjustable"):
            out.append(f"V_{name} {net['OUT']} 0 {circuit.sensor.electronics.supply_volts}")
    # the controller
    for k, e in enumerate("ABCD"):
        for gate, mark in (("HIGH", "r"), ("LOW", "g")):
            out.append(f"V_{gate}_{e} {gate}_{e} 0 {_pwl(steps, k, mark)}")
        if e in "CD":
            out += [f"V_PD_{e} p_{e} 0 {_pwl(steps, k, 'd')}", switch(f"PD_{e}", f"DOWN_{e}", "0", f"p_{e}", PIN_OHMS)]
    # the cable: a foil's wires meet at its electrode
    for e in "ABCD":
        wire = 0.14 * CABLE
        out += [f"R_e{e} E_{e} x_{e} {wire + 1.0 - 0.1 - 0.14 * CABLE}", f"R_s{e} S_{e} x_{e} {wire}"]
        for kind in "ES":
            out.append(f"C_{kind}{e} {kind}_{e} 0 {120e-12 * CABLE}")
        out.append(f"C_p{e} E_{e} S_{e} {60e-12 * CABLE}")
    # the sheets
    for i in range(4):
        for j in range(i):
            if sheets[i][j]:
                out.append(f"R_y{i}{j} x_{'ABCD'[i]} x_{'ABCD'[j]} {-1.0 / sheets[i][j]!r}")
    for one in "AB":
        out += [f"C_l{one}{other} x_{one} x_{other} 125p" for other in "CD"]
    out += [f"V_hum hum 0 SIN(0 {mains} 50)", "C_hum1 hum x_A 15p", "C_hum2 hum x_B 15p"]
    return out


def _pwl(steps: Sequence[tuple[float, str, str]], at: int, mark: str) -> str:
    points, before = [], 0.0
    for time, drives, _ in steps:
        level = 3.3 if drives[at] == mark else 0.0
        if level != before or not points:  # opens before another closes
            later = time + (SWITCHING / 2 if level else 0.0) + 1e-9
            points += [(later, before), (later + 5e-7, level)]
            before = level
    return "PWL(" + " ".join(f"{time:.9g} {level}" for time, level in points) + ")"


def run(elements: Sequence[str], probes: dict[str, tuple[str, float]], end: float) -> dict[str, float]:
    """Run a deck; return the potentials of nets at times [V].

    Args:
        elements: lines of the deck.
        probes: name -> net and time [s].
        end: of the run [s].
    """
    lines = ["a board", ".option reltol=1e-5 abstol=1e-11 vntol=1e-7 method=gear", *elements]
    lines += [
        f".tran 1u {end:.9g} 0 2u",
        *(f".meas tran {n} FIND v({net}) AT={t:.9g}" for n, (net, t) in probes.items()),
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.cir"
        path.write_text("\n".join([*lines, ".end", ""]), encoding="ascii")
        done = subprocess.run(["ngspice", "-b", str(path)], capture_output=True, text=True, timeout=300, check=False)
    found = dict(re.findall(r"^(\w+)\s*=\s*(\S+)", done.stdout, re.MULTILINE))
    if missing := [name for name in probes if name not in found]:
        raise RuntimeError(f"ngspice measured no {', '.join(missing)}: {done.stdout[-1500:]} {done.stderr[-1500:]}")
    return {name: float(found[name]) for name in probes}


def frame_probes(reads: dict[str, float]) -> dict[str, tuple[str, float]]:
    """Return the readings of a frame at the times of a schedule; those of a phase all at once, its first."""
    found = {}
    for phase, time in reads.items():
        for e in _READS[phase]:
            found[f"{phase}_{e.lower()}"] = (f"adc_{e.lower()}", time)
        found[f"{phase}_current"], found[f"{phase}_supply"] = ("adc_i", time), ("adc_s", time)
    return found


def volts_of(circuit: BoardCircuit, sheets: Matrix) -> dict[str, float]:
    """Return what the virtual circuit says of the same readings, at the converter [V]."""
    parts = circuit.sensor.electronics
    volt = parts.adc_volts / parts.current_full_scale
    seen = measure(circuit.sensor, [sheets] * 3)._asdict()
    return {
        name: (seen[name] + parts.current_zero) * volt if name.endswith("current") else seen[name]
        for phase in _READS
        for name in (*(f"{phase}_{e.lower()}" for e in _READS[phase]), f"{phase}_current")
    }


def compare(circuit: BoardCircuit, contacts: Sequence[LayerContact]) -> dict[str, float]:
    """Return the figures of one board, sensor and scene, each a part of the converter's full scale."""
    sensor = circuit.sensor
    full = sensor.electronics.adc_volts
    sheets = FieldContacts().admittances(sensor, [list(contacts)])[0]
    read = 1.2e-3 if circuit.converter else 10e-6

    def seen(sheets: Matrix, slow: float, warm: bool = False, mains: float = 0.0) -> dict[str, float]:
        """Readings at the nominal supply: the decode divides by the rail that each phase has [V]."""
        steps, reads = schedule(sensor, read, slow)
        found = run(deck(circuit, sheets, steps, warm=warm, mains=mains), frame_probes(reads), steps[-1][0])
        zero = sensor.electronics.current_zero * full / sensor.electronics.current_full_scale
        out = {}
        for name, value in found.items():
            phase, _, what = name.partition("_")
            bias = zero if what == "current" else 0.0
            if what != "supply":
                out[name] = bias + (value - bias) * sensor.electronics.supply_volts / found[f"{phase}_supply"]
        return out

    first, settled = seen(sheets, 1.0), seen(sheets, 20.0)
    model = volts_of(circuit, sheets)
    bare = FieldContacts().admittances(sensor, [[]])[0]
    warm, cold, dry = seen(bare, 20.0, warm=True), seen(bare, 20.0), volts_of(circuit, bare)
    # of a current counts what a touch adds: what the inputs of driven electrodes draw is in the untouched one as well
    off = {name: settled[name] - model[name] for name in settled}
    off |= {name: off[name] - (cold[name] - dry[name]) for name in off if name.endswith("current")}
    hum = seen(sheets, 20.0, mains=1.0)
    guides = [name for name in settled if not name.endswith("current")]
    return {
        "agreement": max(map(abs, off.values())) / full,
        "unsettled": max(abs(first[name] - settled[name]) for name in settled) / full,
        "warm": max(abs(warm[name] - cold[name]) for name in guides) / full,
        "mains": max(abs(hum[name] - settled[name]) for name in guides) / full,
        **{f"off {name}": value / full for name, value in off.items()},
    }


def scenes(sensor: Sensor) -> dict[str, list[LayerContact]]:
    """Return the touches: their names say how firm they are."""
    cone = sensor.frustum
    firm = LayerContact(0.5 * cone.slant, 0.5 * cone.wrap, 3e-3, 0.004, 0.004)
    light = LayerContact(0.2 * cone.slant, 0.8 * cone.wrap, 4e-4, 0.003, 0.003)
    return {"3 mS": [firm], ".4 mS": [light]}
