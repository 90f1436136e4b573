"""Page of a board: pins, bill of materials, flashing and scene, as Markdown."""

from __future__ import annotations

from .board_circuit import BoardCircuit

__all__ = ["board_page"]


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
