"""Command ``coneskin firmware``: the sketch of a board, its wiring and its parts, for a sensor.

example:
  coneskin firmware out/sensor.toml --to board              for an Arduino Uno
  coneskin firmware out/sensor.toml --board pico --to board
  coneskin firmware out/sensor.toml --converter ads1115 --to board     15 bits, 40 frames a second

The folder then holds the sketch (coneskin/coneskin.ino), wiring.svg, board.md with pins, cable, first steps, settings
and what the scene must say, parts.csv, board.net for KiCad, and frame_vectors.csv: 50 frames with which other firmware
is tested.
Files that are there already and are others, such as a sketch of your own, are not replaced without --force.
Exit code: 0 written, 1 not written.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from coneskin.core.errors import GeometryError, SceneError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    from coneskin.skin.firmware.boards import BUILT_IN, boards, converters

    add = parser.add_argument
    add("sensor", type=Path, metavar="SENSOR", help="sensor.toml, as coneskin design writes it")
    add("--board", choices=list(boards()), default="uno", help="which board (default: %(default)s)")
    help_text = "the board's own, or two ADS1x15 on its I2C pins (default: %(default)s)"
    add("--converter", choices=[BUILT_IN, *converters()], default=BUILT_IN, help=help_text)
    add("--to", type=Path, required=True, metavar="FOLDER", help="folder to write; made if need be")
    add("--force", action="store_true", help="replace files that are there already and are others")


def run(args: argparse.Namespace) -> int:
    """Write the folder and say what to do next; the exit code is 0."""
    from coneskin.scene.tables.sensor_tables import build_sensor, merge_sensor_file
    from coneskin.skin.firmware.board_circuit import board_circuit
    from coneskin.skin.firmware.board_page import board_page, wiring_diagram
    from coneskin.skin.firmware.boards import board_header, firmware_folder

    problems: list[str] = []
    folder = args.sensor if args.sensor.is_dir() else args.sensor.parent
    written = [path for path in (folder / "sensor.toml", *sorted(folder.glob("sheet-*/sensor.toml"))) if path.is_file()]
    if written and not args.sensor.is_file():
        names = " or ".join(map(str, written))
        raise SceneError([f"a board reads one sheet: name its sensor.toml, which is {names}"], str(args.sensor))
    table = merge_sensor_file({"file": args.sensor.name}, "sensor", args.sensor.parent, problems)
    built = None if problems else build_sensor(table, "sensor", problems)
    if built is None:
        raise SceneError(problems, str(args.sensor))
    circuit = board_circuit(args.board, built[0], args.converter)
    source: Path = firmware_folder()
    own = [*(source / "coneskin").iterdir(), source / "frame_vectors.csv"]
    files = {args.to / path.relative_to(source): path.read_bytes() for path in own if path.is_file()}
    files[args.to / "coneskin" / "coneskin_board.h"] = board_header(args.converter)
    files[args.to / "wiring.svg"] = wiring_diagram(circuit).encode()
    files[args.to / "parts.csv"] = circuit.part_list().encode()
    files[args.to / "board.net"] = circuit.kicad_netlist().encode()
    files[args.to / "board.md"] = board_page(circuit).encode()
    there = [str(path) for path, data in files.items() if path.exists() and path.read_bytes() != data]
    if there and not args.force:
        raise GeometryError(
            f"{', '.join(there)} would be replaced: name another folder with --to, or replace them with --force"
        )
    for path, data in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    print(f"wrote firmware, wiring and parts to {args.to}, for: {circuit.facts.title}")
    print(f"next: wire it as in {args.to / 'wiring.svg'} and flash it as in {args.to / 'board.md'}")
    board = f"--board {args.board}" + (f" --converter {args.converter}" if circuit.converter else "")
    print("of several sheets each has a board: the second gets `sensor=1`, as in its board.md, and a --port of its own")
    print(f"then: coneskin init DESIGN-FOLDER {board} --port /dev/ttyACM0 --arm MODEL --host ADDRESS")
    return 0
