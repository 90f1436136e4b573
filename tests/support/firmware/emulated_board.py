"""Emulated board: what the emulator is told, and the bytes that come out of its serial port."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from coneskin.skin.electronics import SENSE_GAIN, shunt_ohms
from coneskin.skin.firmware.board_circuit import PIN_OHMS
from coneskin.skin.firmware.boards import boards
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.source import Openable
from coneskin.skin.virtual.circuit import LayerContact, Matrix
from coneskin.skin.virtual.field_contacts import FieldContacts
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal
from coneskin.skin.virtual.scripted_touch import ScriptedTouch

_STEP = 1e-3  # s; between two states of the sheets while a touch changes


class BoardPrograms(NamedTuple):
    """What is built once: the emulator, and the firmware that it runs."""

    emulator: Path
    firmware: Path


class Conversion(NamedTuple):
    """One conversion of the emulated converter."""

    time: float  #: when it began [s]
    channel: int
    volts: float  #: at its input, without noise [V]
    settled: float  #: what that will be once everything has settled [V]
    drives: tuple[int, ...]  #: of A, B, C, D: 9 at the rail, 2 at ground, 0 free; then both pull-downs


class BoardRun(NamedTuple):
    """What a board did in a time."""

    data: bytes  #: out of its serial port
    conversions: tuple[Conversion, ...]


def sheets_at_touch(sensor: Sensor, touches: Sequence[ScriptedTouch]) -> list[str]:
    """Return the lines that tell the emulator how the sheets change while they are touched.

    Args:
        sensor: the sheets.
        touches: with their times from now on [s].
    """
    real, model = Imperfections(), FieldContacts()
    ends = [touch.end for touch in touches]
    times = [_STEP * k for k in range(round((max(ends, default=0.0) + 0.5) / _STEP))] if ends else [0.0]
    scenes: list[list[LayerContact]] = []
    for time in times:
        scenes.append([])
        for touch in touches:
            force = touch.seated_at(time, real.foam)
            if force > real.layers.threshold_force:
                reach = real.layers.touch(touch.firmest, touch.radius).radius
                contact = real.layers.touch(force, touch.radius)
                scenes[-1].append(LayerContact(touch.u, touch.phi, contact.siemens, contact.radius, reach))
    lines: list[str] = []
    before: Matrix = ()
    for time, sheets in zip(times, model.admittances(sensor, scenes), strict=True):
        if sheets != before:
            lines.append(f"{time:.4f} sheets " + " ".join(repr(y) for row in sheets for y in row))
            before = sheets
    return lines


def run_board(
    programs: BoardPrograms,
    sensor: Sensor,
    seconds: float,
    touches: Sequence[ScriptedTouch] = (),
    commands: Iterable[str] = (),
    parts: Mapping[str, float] | None = None,
    trace: Path | None = None,
) -> BoardRun:
    """Run a board for a time, as fast as it goes.

    Args:
        programs: emulator and firmware.
        sensor: sheets and electronics.
        seconds: the board's own time [s].
        touches: of the sensor.
        commands: further lines for the emulator, as "0.5 power off".
        parts: of the circuit that are others than the sensor's electronics say.
        trace: file for the conversions; none are told by default.
    """
    told = "\n".join([*sheets_at_touch(sensor, touches), *commands, ""])
    words = _words(programs, sensor, "1", str(trace or "-"), seconds, parts)
    done = subprocess.run(words, input=told.encode(), capture_output=True, timeout=60 + 60 * seconds, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"the emulator ended with {done.returncode}: {done.stderr.decode()}")
    return BoardRun(done.stdout, tuple(_conversions(trace)) if trace else ())


class EmulatedBoard(Openable):
    """A board that runs in real time behind a pseudo-terminal; it ends with this process.

    Args:
        programs: emulator and firmware.
        sensor: sheets and electronics.
        parts: of the circuit that are others than the sensor's electronics say.

    Attributes:
        path: of its serial port; empty before ``open``.
    """

    def __init__(self, programs: BoardPrograms, sensor: Sensor, parts: Mapping[str, float] | None = None) -> None:
        self._programs, self._sensor, self._parts = programs, sensor, parts
        self.path = ""
        self._ends: list[int] = []
        self._process: subprocess.Popen[bytes] | None = None

    def open(self) -> None:
        """Power the board.

        Raises:
            SkinConnectionError: this system has no pseudo-terminals, or none is left.
        """
        if self._process is not None:
            return
        master, slave, self.path = open_raw_terminal()
        self._ends = [slave, master]
        words = _words(self._programs, self._sensor, str(master), "-", 0.0, self._parts)
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, pass_fds=(master,))
        self.tell(*sheets_at_touch(self._sensor, ()))

    def tell(self, *lines: str) -> None:
        """Give the emulator lines, as "0 hang"; what they mean is in simavr_board.c."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.write(("\n".join(lines) + "\n").encode())
            self._process.stdin.flush()

    def touch(self, u: float, phi: float, force: float = 10.0, duration: float = 0.5) -> None:
        """Touch the sensor now; u [m], phi [rad], force [N], duration [s]."""
        self.tell(*sheets_at_touch(self._sensor, [ScriptedTouch(0.0, duration, u, phi, force)]))

    def unplug(self) -> None:
        """Pull the plug: the port is gone for whoever reads it."""
        self._end_process()
        while self._ends:
            os.close(self._ends.pop())

    def close(self) -> None:
        """Take power and port away; may be called twice."""
        self.unplug()

    def _end_process(self) -> None:
        process, self._process = self._process, None
        if process is not None and process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()  # it ends with its standard input
            process.wait(60.0)


def _words(
    programs: BoardPrograms, sensor: Sensor, port: str, trace: str, seconds: float, parts: Mapping[str, float] | None
) -> list[str]:
    """Return the command line of the emulator."""
    electronics = sensor.electronics
    numbers = {
        "supply": electronics.supply_volts,
        "shunt": shunt_ohms(electronics),
        "gain": SENSE_GAIN,
        "bias": electronics.current_zero * SENSE_GAIN * shunt_ohms(electronics),
        "reference": electronics.adc_volts,
        "pulldown": round(
            1.0 / (1.0 / (electronics.pulldown_ohms - 3.0) - 1.0 / electronics.input_ohms) - PIN_OHMS - 1.0
        ),
        "pin": PIN_OHMS,
        "input": electronics.input_ohms,
        **(parts or {}),
    }
    uno = boards()["uno"]
    own = (*uno.sense, uno.current, uno.supply)
    channels = list("012345") if numbers.get("chip") else [pin.removeprefix("A") for pin in own]
    down = ("14", "15") if numbers.get("chip") == 1867 else uno.pull_down  # A0 and A1
    pins = ",".join([*uno.rail, *uno.ground, *down, *channels])
    first = [str(programs.emulator), str(programs.firmware), port, trace, repr(seconds)]
    return [*first, f"pins={pins}", *(f"{name}={value!r}" for name, value in numbers.items())]


def _conversions(trace: Path) -> Iterable[Conversion]:
    with trace.open(encoding="ascii") as lines:
        for line in lines:
            time, channel, volts, settled, *drives = line.split()
            yield Conversion(float(time), int(channel), float(volts), float(settled), tuple(map(int, drives)))
