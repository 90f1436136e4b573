"""Touch on the emulated board to a standing arm, through guard, driver process and simulated controller.

    python -m bench firmware-guard [--touches 10] [--picture docs/images/firmware.png]

Times from the touch [ms]: its first frame above the threshold decoded, stop written to the driver process, arm measured
slower, standstill measured. Board, arm and guard share this computer, which the board's emulator keeps busy. A touch is
given to the emulator for its next millisecond; the foam yields for some milliseconds before the layers meet.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

from bench.report import head, quantile
from coneskin.core.errors import Collision
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.runs.replay.run import read_run
from coneskin.runs.replay.run_picture import draw_run
from coneskin.session.session import guard
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.firmware.emulated_board import BoardPrograms, EmulatedBoard, sheets_at_touch
from tests.support.firmware.firmware_build import build_emulator, build_sketch, missing_tools
from tests.support.firmware.guarded_board import board_scene
from tests.support.scenes import GOAL, START

STAGE_NAMES = ("frame", "stop written", "slower", "standstill")


def one_touch(programs: BoardPrograms, path: Path) -> dict[str, float]:
    """Let the arm move, touch the board, and return the times [ms]."""
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller:
        sensor = board_scene(controller.host, "none").sensors[0].sensor
        press = sheets_at_touch(sensor, [ScriptedTouch(0.0, 0.4, 0.13, 1.55, 10.0)])
        with (
            EmulatedBoard(programs, sensor) as board,
            guard(board_scene(controller.host, board.path), recording=path) as session,
        ):

            def move() -> None:
                with suppress(Collision):
                    session.arm.move_j(GOAL, speed=1.0, acceleration=4.0)

            thread = threading.Thread(target=move)
            thread.start()
            while max(map(abs, controller.state()["qd"])) < 0.9:
                time.sleep(0.005)
            touched = time.monotonic()
            board.tell(*press)
            thread.join(30.0)
            session.wait_for(("touch_ended",), 10.0)
    run = read_run(path)
    contact = next(event for event in run.events if event.name == "contact")
    found = {"frame": contact.time}
    found["stop written"] = min(b.time for b in run.blocks if b.kind == BlockKind.COMMAND and b.time >= contact.time)
    for name, event_name in (("slower", "decelerating"), ("standstill", "standstill")):
        found[name] = next(e.time for e in run.events if e.name == event_name and e.time >= contact.time)
    return {name: 1e3 * (at - touched) for name, at in found.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--touches", type=int, default=10)
    parser.add_argument("--picture", type=Path, help="draw the last run there")
    args = parser.parse_args()
    if missing := missing_tools():
        print(missing, file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        programs = BoardPrograms(build_emulator(folder), build_sketch(folder))
        found = [one_touch(programs, folder / f"run{number}.rec") for number in range(args.touches)]
        if args.picture:
            draw_run(read_run(folder / f"run{args.touches - 1}.rec"), args.picture)
    print(head("ur-rtde"))
    print(f"\n{'from the touch, ms':<22}{'p50':>8}{'worst':>8}   {args.touches} touches")
    for what in STAGE_NAMES:
        values = [one[what] for one in found]
        print(f"{what:<22}{quantile(values, 0.5):>8.1f}{max(values):>8.1f}")
    return 0
