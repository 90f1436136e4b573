"""Command ``coneskin firmware``: the sketch of a board, its wiring and its parts, for a sensor.

example:
  coneskin firmware out/sensor.toml -o board                for an Arduino Uno
  coneskin firmware out/sensor.toml --board pico -o board
  coneskin firmware out/sensor.toml --converter ads1115 -o board       15 bits, 40 frames a second

The folder then holds the sketch (coneskin/coneskin.ino), wiring.svg, board.md with pins, cable, first steps, settings
and what the scene must say, parts.csv, board.net for KiCad, and frame_vectors.csv: 50 frames with which other firmware
is tested. With --flash the sketch goes onto the board too: by avr-gcc and avrdude for an Uno or Nano (Debian: apt-get
install gcc-avr avr-libc arduino-core-avr avrdude), else by arduino-cli, where one of them is installed.
Files that are there already and are others, such as a sketch of your own, are not replaced without --force.
Exit code: 0 written, 1 not written or not flashed.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError, SceneError, SkinConnectionError

if TYPE_CHECKING:
    from coneskin.skin.firmware.board_circuit import BoardCircuit

_AVR_CORE = Path("/usr/share/arduino/hardware/arduino/avr")  # of Debian's arduino-core-avr
_AVR_OPTIONS = (
    *("-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR"),
    *("-Os", "-w", "-std=gnu++11", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-fno-exceptions"),
    *("-fno-threadsafe-statics", "-DDECIMAL_DIG=__DECIMAL_DIG__"),  # which this compiler defines for C only
)
_BOOTLOADER_BAUDS = ("115200", "57600")  # bit/s; of an Uno, and of a Nano with the old bootloader


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    from coneskin.skin.firmware.boards import BUILT_IN, boards, converters

    add = parser.add_argument
    add("sensor", type=Path, metavar="SENSOR", help="sensor.toml, as coneskin design writes it")
    add("--board", choices=list(boards()), default="uno", help="which board (default: %(default)s)")
    help_text = "the board's own, two ADS1x15 on its I2C pins, or an LTC1867 on SPI (default: %(default)s)"
    add("--converter", choices=[BUILT_IN, *converters()], default=BUILT_IN, help=help_text)
    add("-o", "--output", type=Path, required=True, metavar="FOLDER", help="folder to write; made if need be")
    add("--flash", metavar="PORT", help="compile the sketch and write it onto the board at this port")
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
    files = {args.output / path.relative_to(source): path.read_bytes() for path in own if path.is_file()}
    files[args.output / "coneskin" / "coneskin_board.h"] = board_header(args.converter)
    files[args.output / "wiring.svg"] = wiring_diagram(circuit).encode()
    files[args.output / "parts.csv"] = circuit.part_list().encode()
    files[args.output / "board.net"] = circuit.kicad_netlist().encode()
    files[args.output / "board.md"] = board_page(circuit).encode()
    there = [str(at) for at, data in files.items() if at.exists() and not (at.is_file() and at.read_bytes() == data)]
    if there and not (args.force and all(Path(path).is_file() for path in there)):  # a FIFO is none
        raise GeometryError(
            f"{', '.join(there)} would be replaced: name another folder with -o, or replace them with --force"
        )
    for path, data in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    print(f"wrote firmware, wiring and parts to {args.output}, for: {circuit.facts.title}")
    if circuit.clip_share < 2.0:
        print(f"warning: R1 is too large for these sheets, a short may be missed: see {args.output / 'board.md'}")
    if args.flash:
        _flash(args.output / "coneskin", circuit, args.flash)
        print(f"flashed the board at {args.flash}")
    print(f"next: wire it as in {args.output / 'wiring.svg'} and flash it as in {args.output / 'board.md'}")
    print("of several sheets each has a board: the second gets `sensor=1`, as in its board.md, and a --port of its own")
    print(f"then: coneskin init DESIGN-FOLDER {circuit.words} --port {circuit.facts.port} --arm MODEL --host ADDRESS")
    return 0


def _flash(sketch: Path, circuit: BoardCircuit, port: str) -> None:
    """Compile a sketch and write it onto a board, by what is installed.

    Raises:
        SkinConnectionError: nothing that can is installed, it does not compile, or the board does not take it.
    """
    board, target = circuit.board.name, circuit.facts.target
    if board == "uno" and all(map(shutil.which, ("avr-gcc", "avrdude"))) and _AVR_CORE.is_dir():
        with TemporaryDirectory() as folder:
            program = _compile_for_uno(sketch, Path(folder))
            words = ["avrdude", "-q", "-p", "atmega328p", "-c", "arduino", "-P", port, "-D"]
            words += ["-U", f"flash:w:{program}:e"]
            tries = (_said([*words, "-b", baud]) for baud in _BOOTLOADER_BAUDS)
            if (said := next(tries)) and next(tries):
                raise SkinConnectionError(f"avrdude cannot write to the board at {port}: {said}")
    elif shutil.which("arduino-cli"):
        _run(["arduino-cli", "compile", "--upload", "--fqbn", target, "--port", port, str(sketch)])
    else:
        packages = "gcc-avr avr-libc arduino-core-avr avrdude (apt-get), or " if board == "uno" else ""
        raise SkinConnectionError(
            f"no compiler for a {circuit.facts.title}: install {packages}arduino-cli with the core of {target}"
        )


def _compile_for_uno(sketch: Path, folder: Path) -> Path:
    """Compile a sketch for an Uno with Debian's Arduino core, into a folder; return the program, an ELF file."""
    core = _AVR_CORE / "cores/arduino"
    wire, spi, memory = (_AVR_CORE / f"libraries/{name}/src" for name in ("Wire", "SPI", "EEPROM"))
    places = (core, _AVR_CORE / "variants/standard", memory, wire, spi, sketch)
    source, program = folder / "coneskin.cpp", folder / "coneskin.elf"
    source.write_bytes(b"#include <Arduino.h>\n" + (sketch / "coneskin.ino").read_bytes())
    files = [source, *(path for end in ("c", "cpp", "S") for path in sorted(core.glob(f"*.{end}")))]
    files += [wire / "Wire.cpp", wire / "utility/twi.c", spi / "SPI.cpp"]
    _run(["avr-gcc", *_AVR_OPTIONS, *(f"-I{place}" for place in places), *map(str, files), "-lm", "-o", str(program)])
    return program


def _run(words: Sequence[str]) -> None:
    if said := _said(words):
        raise SkinConnectionError(f"{words[0]} failed: {said}")


def _said(words: Sequence[str]) -> str:
    """Run a program; return its last words where it failed, else nothing."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=300.0, check=False)
    lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
    return "" if done.returncode == 0 else "; ".join(lines[-3:]) or f"exit code {done.returncode}"
