"""Rate, jitter and settling of the firmware of an Uno, as compiled, in the emulator.

First table: frames per second when the next frame begins as soon as one is done. Second table: how regular frames are
at the usual 200 a second, by the emulated controller's cycles. Third table: how far the guides are from where they will
settle when they are read, for contacts of several conductances and times of settling, as an error of the place; and the
same where the sketch does not hold the guides at ground while the driven sheet settles.
Needs the packages that tests/firmware needs.

The emulator counts the controller's cycles, so the numbers do not depend on this computer. Sensor: 75 mm x 240 mm, 350
deg, 1000 ohm per square; cables of 330 pF to each electrode, 500 pF between the layers, pins of 25 ohm, inputs of 10
Mohm.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from bench.report import head, quantile, show
from coneskin.geometry.frustum import Frustum
from coneskin.skin.firmware.board_circuit import board_circuit
from coneskin.skin.firmware.boards import firmware_folder
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.virtual.field_contacts import FieldContacts
from coneskin.skin.wire import FrameDecoder
from tests.support.firmware.emulated_board import BoardPrograms, BoardRun, run_board
from tests.support.firmware.firmware_build import build_emulator, build_sketch, missing_tools

SENSOR = board_circuit("uno", Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350)))).sensor
SETTLING_TIMES = (20, 50, 150, 500)  # us
CONTACT_PLACES = ((0.05, 1.0), (0.2, 5.0))  # u [m], phi [rad]
HELD_LINE = "drive_all(a == FREE ? GROUND : a, b == FREE ? GROUND : b, c == FREE ? GROUND : c, d == FREE ? GROUND : d);"


def held_sheets(contacts: Sequence[LayerContact]) -> str:
    """A command of the emulator: the sheets with contacts that stay."""
    matrix = FieldContacts().admittances(SENSOR, [contacts])[0]
    return "0 sheets " + " ".join(repr(float(y)) for row in matrix for y in row)


def rates(programs: BoardPrograms) -> list[list[str]]:
    rows = []
    for name, length in (("36 bytes", 36), ("40 bytes", 40), ("52 bytes (usual)", 52)):
        row = []
        for bits in range(4):
            told = [f"frame_length={length}", f"extra_bits={bits}", "rate_hz=1000"]
            commands = [f"{0.02 + 0.03 * k} port {line}" for k, line in enumerate(told)]
            frames = FrameDecoder().feed(run_board(programs, SENSOR, 1.0, commands=commands).data)
            last = max(number for number, frame in enumerate(frames) if frame.sequence == 0)  # all is set from here on
            row.append(1e6 * (frames[-1].sequence - 1) / (frames[-1].clock_us - frames[last + 1].clock_us))
        rows.append([name, *(f"{rate:.0f}" for rate in row)])
    return rows


def jitter(programs: BoardPrograms, folder: Path) -> list[list[str]]:
    run = run_board(programs, SENSOR, 2.0, commands=[held_sheets(())], trace=folder / "trace")
    begins = [
        after.time
        for before, after in pairwise(run.conversions)
        if after.drives[4:] == (2, 2) and before.drives[4:] != (2, 2)
    ]
    true = [1e6 * (b - a) - 5000.0 for a, b in pairwise(begins[10:])]
    frames = FrameDecoder().feed(run.data)
    told = [float(b.clock_us - a.clock_us - 5000) for a, b in pairwise(frames[10:])]
    rows = []
    for name, values in (("first reading, true time", true), ("device clock in the frame", told)):
        sizes = [abs(value) for value in values]
        largest = quantile(sizes, 0.5), quantile(sizes, 0.99), max(sizes)
        rows.append([name, str(len(sizes)), *(f"{size:.1f}" for size in largest)])
    return rows


def worst_guide(run: BoardRun) -> float:
    """Worst distance of a guide from where it settles, in the radial and angular phase, as an error of place [mm]."""
    slant, around = 1e3 * SENSOR.frustum.slant, 1e3 * SENSOR.frustum.radius1 * SENSOR.frustum.wrap
    worst = 0.0
    for one in run.conversions:
        lengths = {(2, 9, 0, 0): (slant, (2, 3)), (0, 0, 9, 2): (around, (0, 1))}
        length, guides = lengths.get(one.drives[:4], (0.0, ()))
        if one.time > 0.06 and one.channel in guides:
            worst = max(worst, length * abs(one.volts - one.settled) / SENSOR.electronics.supply_volts)
    return worst


def settling(programs: BoardPrograms, folder: Path) -> list[list[str]]:
    rows = []
    for ohms in (math.inf, 100e3, 45e3, 20e3, 10e3, 1e3):  # level 0.10, a touch, is 45 kohm; 0.20, a place, 20 kohm
        row, conductance = [], 1.0 / ohms
        for time in SETTLING_TIMES:
            worst = 0.0
            for u, phi in CONTACT_PLACES if conductance else CONTACT_PLACES[:1]:
                contacts = [LayerContact(u, phi, conductance, 0.004)] if conductance else []
                commands = [held_sheets(contacts), f"0.02 port settle_us={time}"]
                run = run_board(programs, SENSOR, 0.12, commands=commands, trace=folder / "trace")
                worst = max(worst, worst_guide(run))
            row.append(worst)
        name = {45e3: "45 kohm: a touch begins", 20e3: "20 kohm: a place is read"}.get(ohms, f"{1e-3 * ohms:g} kohm")
        name = name if conductance else "none"
        rows.append([name, *(f"{worst:.3f}" for worst in row)])
    return rows


def main() -> int:
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    if missing := missing_tools():
        print(missing, file=sys.stderr)
        return 1
    print(head())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        programs = BoardPrograms(build_emulator(folder), build_sketch(folder))
        text = (firmware_folder() / "coneskin" / "coneskin.ino").read_text(encoding="utf-8")
        assert HELD_LINE in text, "the sketch no longer holds the guides as this bench knows it"
        (folder / "floating.ino").write_text(text.replace(HELD_LINE, "drive_all(a, b, c, d);"), encoding="utf-8")
        floating = BoardPrograms(programs.emulator, build_sketch(folder, folder / "floating.ino"))
        show("frames per second, back to back", ["frame", "1 a reading", "2", "4", "8"], rates(programs))
        columns = ["", "frames", "p50 us", "p99 us", "worst us"]
        show("interval of frames less 5000 us, at 200 a second", columns, jitter(programs, folder))
        columns = ["contact", *(f"{time} us" for time in SETTLING_TIMES)]
        show("error of the place when a guide is read, worst of two places, mm", columns, settling(programs, folder))
        title = "the same, guides left floating while the driven sheet settles, mm"
        show(title, columns, settling(floating, folder))
    return 0
