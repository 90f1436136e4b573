"""Build of the sketch with the Arduino core, and of the emulator that runs it, by the compilers of the system."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from coneskin.skin.firmware.boards import firmware_folder

#: what must be installed, on Debian and its kin
PACKAGES = "gcc libc6-dev gcc-avr avr-libc arduino-core-avr libsimavr-dev libelf-dev"
_CORE = Path("/usr/share/arduino/hardware/arduino/avr")
_WIRE = _CORE / "libraries/Wire/src"
_SPI = _CORE / "libraries/SPI/src"
_NEEDED = (_CORE / "cores/arduino/Arduino.h", Path("/usr/include/simavr/sim_avr.h"))
_BOARD = ("-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR")
_SMALL = ("-Os", "-ffunction-sections", "-fdata-sections")
_C = (*_SMALL, "-std=gnu11")
# the core's class of texts needs a constant that this compiler defines for C only
_CPP = (*_SMALL, "-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics", "-DDECIMAL_DIG=__DECIMAL_DIG__")


def missing_tools() -> str:
    """Return what is missing to build and run the firmware here, and how to get it; "" where nothing is."""
    missing = [tool for tool in ("gcc", "avr-gcc", "avr-g++") if shutil.which(tool) is None]
    missing += [str(path) for path in _NEEDED if not path.exists()]
    return f"no {', '.join(missing)}: apt-get install {PACKAGES}" if missing else ""


def build_sketch(folder: Path, sketch: Path | None = None, chip: int = 0) -> Path:
    """Compile a sketch for an Uno with the whole Arduino core, as its IDE does.

    Args:
        folder: where the objects go; those of the core that are there already are taken.
        sketch: the .ino file; the product's by default. It finds the product's headers.
        chip: 1015 or 1115 for an ADS1015 or ADS1115, 1867 for an LTC1867 in place of the board's own converter.

    Returns:
        the program, an ELF file.

    Raises:
        RuntimeError: the compiler refuses it; the message is its own.
    """
    product = firmware_folder()
    sketch = sketch or product / "coneskin" / "coneskin.ino"
    places = (_CORE / "cores/arduino", _CORE / "variants/standard", _CORE / "libraries/EEPROM/src", _WIRE, _SPI)
    headers = [f"-I{place}" for place in (*places, product / "coneskin")]
    core = _CORE / "cores/arduino"
    jobs: list[tuple[str, tuple[str, ...], Path]] = [
        ("avr-gcc", (*_C, "-w"), path) for path in sorted(core.glob("*.c"))
    ]
    jobs += [("avr-g++", (*_CPP, "-w"), path) for path in sorted(core.glob("*.cpp"))]
    jobs.append(("avr-gcc", ("-x", "assembler-with-cpp", "-w"), core / "wiring_pulse.S"))
    if chip == 1867:
        jobs.append(("avr-g++", (*_CPP, "-w"), _SPI / "SPI.cpp"))
    elif chip:
        jobs += [("avr-g++", (*_CPP, "-w"), _WIRE / "Wire.cpp"), ("avr-gcc", (*_C, "-w"), _WIRE / "utility/twi.c")]
    strict = (f"-DCONESKIN_CONVERTER={chip}", "-Wall", "-Wextra", "-Werror", "-x", "c++", "-include", "Arduino.h")
    jobs.append(("avr-g++", (*_CPP, *strict), sketch))
    objects = []
    for compiler, options, source in jobs:
        objects.append(str(folder / f"{source.name}.o"))
        if source != sketch and Path(objects[-1]).exists():  # the core, from an earlier sketch
            continue
        _run([compiler, "-c", *_BOARD, *options, *headers, str(source), "-o", objects[-1]])
    program = folder / f"{sketch.stem}{chip or ''}.elf"
    _run(["avr-gcc", "-Os", "-mmcu=atmega328p", "-Wl,--gc-sections", *objects, "-lm", "-o", str(program)])
    return program


def build_emulator(folder: Path) -> Path:
    """Compile the emulator.

    Args:
        folder: where it goes.

    Raises:
        RuntimeError: the compiler refuses it.
    """
    program = folder / "simavr_board"
    source = Path(__file__).with_name("simavr_board.c")
    _run(["gcc", "-O2", "-Wall", "-Wextra", "-Werror", str(source), "-o", str(program), "-lsimavr", "-lelf", "-lm"])
    return program


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
