"""Page of a board: pins, cable, first steps and scene, as Markdown; and its drawing, as SVG."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from textwrap import indent
from xml.sax.saxutils import escape

from .board_circuit import WIRES, BoardCircuit, Component, toml_lines
from .boards import firmware_folder, part_catalog


def board_page(circuit: BoardCircuit) -> str:
    """Return the page that stands beside the sketch."""
    sensor, parts = circuit.sensor, circuit.sensor.electronics
    rate, remark = circuit.facts.rate, f"{circuit.facts.remark} "
    if (other := circuit.converter) is not None:  # what is remarked is of the board's own converter
        chips = f"{'an' if other.pull_down else 'two'} {other.name.upper()} in place of its converter"
        rate, remark = f"{other.rate_hz}, measured in emulation on an Uno, with {chips}", ""
    limits = ["[monitoring]", *toml_lines(circuit.monitoring)] if circuit.monitoring else []
    row, bought = part_catalog()[circuit.board.name], csv.DictReader(circuit.part_list().splitlines())
    template = (firmware_folder() / "board_page.txt").read_text(encoding="utf-8")
    return template.format(
        circuit=circuit,
        parts=parts,
        rate=rate,
        remark=remark,
        radial=1e3 * sensor.radial_amperes,
        angular=1e3 * sensor.angular_amperes,
        radial_ends="B to A" if sensor.b_positive else "A to B",
        angular_ends="C to D" if sensor.c_positive else "D to C",
        price=sum(float(row["EUR"]) for row in bought if row["names"] != "A1"),
        row=row,
        pins="\n".join(f"| {pin} | {net} |" for pin, net in circuit.pins.items()),
        poles="\n".join(f"| {number} | {net} | {colour} |" for number, (net, colour) in enumerate(WIRES, 1)),
        zero=parts.count_amperes(0.0),
        zero_most=round(0.012 * parts.full_count),
        zero_near=max(2, parts.full_count // 1000),
        supply=parts.count_volts(parts.supply_volts),
        radial_counts=parts.count_amperes(sensor.radial_amperes),
        angular_counts=parts.count_amperes(sensor.angular_amperes),
        guide_most=max(2, parts.full_count // 100),
        keys=indent("\n".join(toml_lines(circuit.keys)), "    "),
        limits="".join(f"    {line}\n" for line in limits),
        settings=_settings(circuit),
    )


def _settings(circuit: BoardCircuit) -> str:
    """Return what is to be said of settings that are not the sketch's own."""
    sensor, parts = circuit.sensor, circuit.sensor.electronics
    usual_share = 758 if circuit.converter is None else circuit.converter.permille
    wanted = {
        "device": (sensor.device_id, 0),
        "sensor": (sensor.sensor_id, 0),
        "supply_permille": (round(1e3 * parts.supply_volts / parts.adc_volts), usual_share),
        "a_positive": (int(not sensor.b_positive), 0),
        "d_positive": (int(not sensor.c_positive), 0),
    }
    changed = [f"    {name}={value}\n" for name, (value, usual) in wanted.items() if value != usual]
    return "".join(["\nSettings, each a line over the serial port, then `save`:\n\n", *changed]) if changed else ""


_WIDTH, _FIRST_ROW, _ROW_HEIGHT, _GROUP_GAP = 1520, 100, 15, 26  # of the drawing; of a row, between two groups
_COLUMN_GROUPS = (  # x, and what stands there from top to bottom
    (130, ("the board",)),
    (410, ("supply and current", "converter")),
    (730, ("switches", "clamps, at J1")),
    (1050, ("electrode A", "electrode B", "electrode C")),
    (1370, ("electrode D", "connector and test points")),
)
_NET_COLOURS = {"GND": "#555", "SHIELD": "#555", "5V": "#b02a1a", "3V3": "#b02a1a", "REG": "#b02a1a", "RAIL": "#b02a1a"}
_SVG_STYLE = (
    "text{font:11px sans-serif;fill:#222}.title{font-size:18px;font-weight:bold}.group{font-size:14px;font-weight:bold}"
    "path,rect{fill:none;stroke:#222;stroke-width:1.2}rect{fill:#eef3f6}.name{font-weight:bold}"
)


def wiring_diagram(circuit: BoardCircuit) -> str:
    """Return the drawing: every part with its pins, and at each pin the name of its net; equal names are joined."""
    catalog, lowest = part_catalog(), 0
    out: list[str] = []
    for x, groups in _COLUMN_GROUPS:
        y = _FIRST_ROW
        for group in groups:
            components = [c for c in circuit.components if c.group == group]
            if not components:
                continue
            out.append(_text(x - 110, y, group, "group"))
            y += 12
            for component in components:
                row = catalog[component.part]
                pads = {} if component.name == "A1" else row["pins"]  # its own names stand on it
                value = component.pins["1"] if component.part == "test_point" else component.value
                drawn, height = _drawn(x, y, component, value or row["number"].split()[-1], pads)
                out += drawn
                y += height
            y += _GROUP_GAP
        lowest = max(lowest, y)
    head = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {lowest + 10}" role="img">',
        f"<style>{_SVG_STYLE}</style>",
        f'<rect width="{_WIDTH}" height="{lowest + 10}" style="fill:#fff;stroke:none"/>',
        _text(20, 36, f"{circuit.facts.title} and {circuit.sensor.name}", "title"),
        _text(20, 58, "Equal words are joined; numbers are pads, of A1 names on it. E drives, S reads: twisted."),
    ]
    return "\n".join([*head, *out, "</svg>", ""])


def _drawn(x: int, y: int, part: Component, value: str, pads: Mapping[str, list[str]]) -> tuple[list[str], int]:
    """Draw a part around x from y on; return it, and how high it is. Of two pins it is a row, else a box with pads."""
    pins = list(part.pins.items())
    if len(pins) < 3:
        ends = [_net(x - 74, y + 12, pins[0][1], "end"), *(_net(x + 74, y + 12, net, "start") for _, net in pins[1:])]
        body = f'<rect x="{x - 70}" y="{y + 1}" width="140" height="{_ROW_HEIGHT - 1}"/>'
        return [body, _text(x, y + 12, f"{part.name} {value}".strip(), "", "middle"), *ends], _ROW_HEIGHT + 2
    rows, y = (len(pins) + 1) // 2, y + 8  # its title apart from what is above
    out = [
        f'<rect x="{x - 70}" y="{y + 16}" width="140" height="{rows * _ROW_HEIGHT + 4}"/>',
        _text(x, y + 12, f"{part.name} {value}", "name", "middle"),
    ]
    for k, (pin, net) in enumerate(pins):
        left, at = k < rows, y + 16 + _ROW_HEIGHT * (k % rows + 1) - 2
        numbers = pads.get(pin, [])
        both = [",".join(numbers[:3]) + ("..." if len(numbers) > 3 else ""), pin]
        told = " ".join(both if left else both[::-1]).strip()
        out.append(_text(x - 66 if left else x + 66, at, told, "", "start" if left else "end"))
        out.append(_net(x - 74 if left else x + 74, at, net, "end" if left else "start"))
    return out, rows * _ROW_HEIGHT + 40


def _net(x: int, y: int, net: str, anchor: str) -> str:
    colour = _NET_COLOURS.get(net, "#1a5cb0" if net.startswith(("S_", "ADC_")) else "#1a7a3a")
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}" style="fill:{colour}">{escape(net)}</text>'


def _text(x: int, y: int, words: str, css: str = "", anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" class="{css}" text-anchor="{anchor}">{escape(words)}</text>'
