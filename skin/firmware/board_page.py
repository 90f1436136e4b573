"""Page of a board: pins, parts, flashing and scene, as Markdown; and its wiring diagram, as SVG."""

from __future__ import annotations

from xml.sax.saxutils import escape

from coneskin.skin.electronics import SENSE_GAIN

from .board_circuit import BoardCircuit, ohms_text


def board_page(circuit: BoardCircuit) -> str:
    """Return the page that stands beside the sketch."""
    board, facts, sensor = circuit.board, circuit.facts, circuit.sensor
    parts = sensor.electronics
    lines = [
        f"# {facts.title} for {sensor.name}",
        "",
        f"Wiring: wiring.svg. {_remark(circuit)}Frames per second: {_rate(circuit)}. This is no safety-rated device.",
        "",
        f"Drive currents: {1e3 * sensor.radial_amperes:.3g} mA from {_ends(sensor.b_positive, 'B', 'A')}, "
        f"{1e3 * sensor.angular_amperes:.3g} mA from {_ends(sensor.c_positive, 'C', 'D')}; full scale "
        f"{1e3 * parts.current_full_scale:.3g} mA.",
        "",
        "| pin | to |",
        "|---|---|",
        *(f"| {pin} | {to} |" for pin, to in _pins(circuit)),
        "",
        "| count | part | value | where |",
        "|---|---|---|---|",
        *(f"| {part.number} | {part.what} | {part.value} | {part.where} |" for part in circuit.parts),
        "",
        "Flash:",
        "",
        f"    arduino-cli compile --upload --fqbn {facts.target} --port /dev/ttyACM0 coneskin",
        "",
        "The scene:",
        "",
        *(f"    {line}" for line in circuit.scene_lines.splitlines()),
        "",
    ]
    settings = _settings(circuit)
    if settings:
        lines += [
            "Settings, each a line over the serial port, then `save`:",
            "",
            *(f"    {line}" for line in settings),
            "",
        ]
    if board.common:
        lines += [f"Address of the multiplexer, lowest bit first: pins {', '.join(board.select)}.", ""]
    return "\n".join(lines)


def _remark(circuit: BoardCircuit) -> str:
    """Return the remark of the board; those of its own converter do not matter beside another one."""
    remark = circuit.facts.remark if circuit.converter is None else ""
    return f"{remark[0].upper()}{remark[1:]}. " if remark else ""


def _rate(circuit: BoardCircuit) -> str:
    other = circuit.converter
    if other is None:
        return circuit.facts.rate
    return f"{other.rate_hz}, measured in emulation on an Uno, with two {other.name.upper()} in place of its converter"


def _ends(normal: bool, first: str, second: str) -> str:
    return f"{first} to {second}" if normal else f"{second} to {first}"


def _pins(circuit: BoardCircuit) -> list[tuple[str, str]]:
    board = circuit.board
    channel = "channel {} of the multiplexer" if board.common else "{}"
    found = [
        (channel.format(pin), f"electrode {e}, by a wire of its own")
        for e, pin in zip("ABCD", board.sense, strict=True)
    ]
    found += [(channel.format(board.current), "output of the current-sense amplifier")]
    found += [(channel.format(board.supply), "the rail, behind the shunt")]
    if circuit.converter is not None:
        found += [("SDA, SCL", f"both {circuit.converter.name.upper()}, with 2.2 kohm each to their supply")]
    found += [(pin, f"gate of the switch from the rail to {e}") for e, pin in zip("ABCD", board.rail, strict=True)]
    found += [(pin, f"{e} itself: drives it to ground") for e, pin in zip("ABCD", board.ground, strict=True)]
    found += [(pin, f"pull-down resistor of {e}") for e, pin in zip("CD", board.pull_down, strict=True)]
    return found


def _settings(circuit: BoardCircuit) -> list[str]:
    """Return the settings that are not the sketch's own."""
    sensor = circuit.sensor
    usual_share = 758 if circuit.converter is None else circuit.converter.permille
    wanted = {
        "device": (sensor.device_id, 0),
        "sensor": (sensor.sensor_id, 0),
        "supply_permille": (circuit.supply_permille, usual_share),
        "a_positive": (int(not sensor.b_positive), 0),
        "d_positive": (int(not sensor.c_positive), 0),
    }
    return [f"{name}={value}" for name, (value, usual) in wanted.items() if value != usual]


_WIDTH, _HEIGHT = 1080, 840
_BOARD, _SWITCH, _RAIL, _SHEET = 230, 430, 560, 880  # x of the board's edge, the switches, the rail, the electrodes
_FIRST, _ROW = 230, 150  # y of electrode A, and from one to the next
_ELECTRODE_PLACES = "upper sheet, end 2", "upper sheet, end 1", "lower sheet, phi = wrap", "lower sheet, phi = 0"
_SVG_STYLE = (
    "text{font:14px sans-serif;fill:#222}.small{font-size:12px;fill:#555}.title{font-size:18px;font-weight:bold}"
    "path,rect,circle{fill:none;stroke:#222;stroke-width:1.5}.part{fill:#fff}.rail{stroke:#b02a1a;stroke-width:2.5}"
    ".sense{stroke:#1a5cb0}.dot{fill:#222}.body{fill:#eef3f6}"
)


def wiring_diagram(circuit: BoardCircuit) -> str:
    """Return the diagram."""
    board, parts = circuit.board, circuit.sensor.electronics
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img">',
        f"<style>{_SVG_STYLE}</style>",
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" style="fill:#fff;stroke:none"/>',
        _text(30, 36, f"{circuit.facts.title} and {circuit.sensor.name}", "title"),
        _text(30, 58, "red: rail; blue: wires that only read, each to its electrode; all grounds are joined", "small"),
        f'<rect class="body" x="30" y="80" width="{_BOARD - 30}" height="{_HEIGHT - 110}" rx="8"/>',
        *_supply(circuit),
        *(line for row in range(4) for line in _electrode(circuit, row)),
    ]
    if board.common:
        out.append(_text(40, _HEIGHT - 60, "ch: channel of the multiplexer,", "small"))
        out.append(_text(40, _HEIGHT - 44, f"output {board.common}, address {', '.join(board.select)}", "small"))
    out.append(_text(_RAIL + 12, _HEIGHT - 40, f"each channel: {ohms_text(parts.input_ohms)} to ground", "small"))
    return "\n".join([*out, "</svg>", ""])


def _supply(circuit: BoardCircuit) -> list[str]:
    """Draw regulator, shunt, amplifier and rail."""
    board, parts = circuit.board, circuit.sensor.electronics
    bottom = _FIRST + 3 * _ROW
    return [
        *_pin(
            circuit,
            110,
            "3.3 V and AREF" if "AREF" in circuit.facts.remark and circuit.converter is None else "3.3 V",
            "",
        ),
        _line((_BOARD, 110), (_BOARD + 60, 110)),
        _box(_BOARD + 60, 92, 100, 36, f"{parts.supply_volts:g} V regulator"),
        _line((_BOARD + 160, 110), (_RAIL - 90, 110)),
        _box(_RAIL - 90, 100, 60, 20, ""),
        _text(_RAIL - 100, 92, f"shunt {circuit.shunt_ohms:.3g} ohm"),
        _line((_RAIL - 30, 110), (_RAIL, 110), (_RAIL, bottom), css="rail"),
        *_pin(circuit, 150, "current", board.current),
        _box(_RAIL - 110, 134, 100, 32, f"x {SENSE_GAIN:g}"),
        _line((_RAIL - 100, 110), (_RAIL - 100, 134)),
        _line((_RAIL - 20, 110), (_RAIL - 20, 134)),
        _dot(_RAIL - 100, 110),
        _dot(_RAIL - 20, 110),
        _line((_RAIL - 110, 150), (_BOARD, 150), css="sense"),
        *_pin(circuit, 180, "rail", board.supply),
        _line((_BOARD, 180), (_RAIL, 180), css="sense"),
        _dot(_RAIL, 180),
        _text(_RAIL + 10, 130, "rail"),
    ]


def _electrode(circuit: BoardCircuit, row: int) -> list[str]:
    """Draw what one electrode is wired to."""
    board, name = circuit.board, "ABCD"[row]
    y = _FIRST + row * _ROW
    wire = _RAIL + 150  # x where the driving wires meet
    out = [
        _line((_RAIL, y), (_RAIL + 40, y), css="rail"),
        _dot(_RAIL, y),
        _box(_RAIL + 40, y - 14, 70, 28, "switch"),
        _line((_RAIL + 110, y), (_SHEET, y)),
        *_pin(circuit, y - 22, f"gate {name}", board.rail[row]),
        _line((_BOARD, y - 22), (_SWITCH, y - 22), (_RAIL + 75, y - 22), (_RAIL + 75, y - 14)),
        _text(_BOARD + 40, y - 27, "100 kohm to ground", "small"),
        *_pin(circuit, y + 26, f"ground {name}", board.ground[row]),
        _line((_BOARD, y + 26), (wire, y + 26), (wire, y)),
        _dot(wire, y),
    ]
    if name in "CD":
        out += [
            *_pin(circuit, y + 52, f"pull-down {name}", board.pull_down[row - 2]),
            _line((_BOARD, y + 52), (_BOARD + 60, y + 52)),
            _box(_BOARD + 60, y + 42, 90, 20, ohms_text(circuit.sensor.electronics.pulldown_ohms)),
            _line((_BOARD + 150, y + 52), (wire + 30, y + 52), (wire + 30, y)),
            _dot(wire + 30, y),
        ]
    out += [
        *_pin(circuit, y + 78, f"sense {name}", board.sense[row]),
        _line((_BOARD, y + 78), (_SHEET - 30, y + 78), (_SHEET - 30, y + 12), (_SHEET, y + 12), css="sense"),
        f'<rect class="body" x="{_SHEET}" y="{y - 24}" width="175" height="56" rx="4"/>',
        _text(_SHEET + 12, y - 2, f"electrode {name}"),
        _text(_SHEET + 12, y + 18, _ELECTRODE_PLACES[row], "small"),
    ]
    return out


def _pin(circuit: BoardCircuit, y: int, purpose: str, pin: str) -> list[str]:
    """Draw a pin at the board's edge, with what it is for."""
    channels = {*circuit.board.sense, circuit.board.current, circuit.board.supply}
    analog = purpose.split()[0] in ("sense", "current", "rail")
    shown = f"ch {pin}" if circuit.board.common and analog and pin in channels else pin
    label = _text(44, y + 5, purpose, "small")
    return [label, f'<text x="{_BOARD - 10}" y="{y + 5}" text-anchor="end">{escape(shown)}</text>', _dot(_BOARD, y)]


def _text(x: int, y: int, words: str, css: str = "") -> str:
    return f'<text x="{x}" y="{y}"{f" class={chr(34)}{css}{chr(34)}" if css else ""}>{escape(words)}</text>'


def _line(*points: tuple[int, int], css: str = "") -> str:
    path = "M" + " L".join(f"{x} {y}" for x, y in points)
    return f'<path d="{path}"{f" class={chr(34)}{css}{chr(34)}" if css else ""}/>'


def _box(x: int, y: int, width: int, height: int, words: str) -> str:
    rect = f'<rect class="part" x="{x}" y="{y}" width="{width}" height="{height}"/>'
    at = f'x="{x + width // 2}" y="{y + height // 2 + 4}" text-anchor="middle" class="small"'
    return rect + (f"<text {at}>{escape(words)}</text>" if words else "")


def _dot(x: int, y: int) -> str:
    return f'<circle class="dot" cx="{x}" cy="{y}" r="3"/>'
