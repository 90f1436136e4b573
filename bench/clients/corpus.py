"""Programs that others wrote, in the simulated controller: folder -> the share that runs, and the rest by name.

    python -m bench ur-corpus FOLDER [--seconds 30] [--json]

FOLDER has folders of ``.script`` files, which are others' and stay outside this repository: the examples of Universal
Robots' script manual, their URScript_Examples (GitHub), exports of PolyScope, each with its ``.urp``. Each program runs
by itself, as fast as it goes, for so long of its controller's time. A file without a program around it, as a Script
node has one, is run as PolyScope does: as the body of a program. What a program asks for and is not there, as a server,
it meets as on a robot that stands alone, in a network of its own where that can be had (bench `ur-clients`). It runs
where it is neither refused nor aborted; a protective stop is told.
"""

from __future__ import annotations

import argparse
import io
import json
from pathlib import Path
from typing import NamedTuple

from bench import report
from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.ports.rtde import RtdeOutputs
from coneskin.robot.sim.ports.user_interface import _ProgramFolder
from coneskin.robot.sim.urscript.translator import translate
from coneskin.robot.sim.urscript.values import ScriptError

from .trials import enter_own_network

_ARMS = ("UR5e", "UR10e", "UR3e", "UR3", "UR5", "UR10", "UR16e", "UR20")


class Found(NamedTuple):
    """What became of a program; ``why`` is empty where it runs."""

    folder: str
    name: str
    why: str
    told: str


def run(root: Path, path: Path, seconds: float) -> Found:
    """Run one program, with the first arm that it runs with: its text does not say for which it was written."""
    for model in _ARMS:
        found = run_with(model, root, path, seconds)
        if "cannot bring its flange" not in found.why:
            break
    return found


def run_with(model: str, root: Path, path: Path, seconds: float) -> Found:
    """Run one program with an arm."""
    log = io.StringIO()
    controller = Controller(Options(model=model, programs=path.parent), log)
    RtdeOutputs(controller)  # for get_rtde_value
    why = ""
    try:
        made = translate(_ProgramFolder(path.parent).load(path.name).text, Builtins.functions())
        controller.program_arrived()
        controller.load(made)
        for _ in range(round(seconds / controller.steptime)):
            controller.update()
    except (ScriptError, OSError, UnicodeDecodeError) as exc:
        why = f"refused: {exc}"
    events = [json.loads(line) for line in log.getvalue().splitlines()]
    kinds = {event["event"]: event for event in events}
    for kind in ("refused", "abort"):
        why = why or (f"{kind}: {kinds[kind]['reason']}" if kind in kinds else "")
    if not why and "program" not in kinds:
        why = "it did not start"
    told = str(kinds["protective_stop"].get("cause", "")) if "protective_stop" in kinds else ""
    return Found(path.relative_to(root).parts[0], path.relative_to(root).as_posix(), why, told)


def show(found: list[Found]) -> None:
    """Show the share of each folder, and each program that does not run."""
    rows = []
    for name in [*sorted({one.folder for one in found}), ""]:
        here = [one for one in found if not name or one.folder == name]
        runs = [one for one in here if not one.why]
        stops = sum(bool(one.told) for one in runs)
        rows.append([name or "all", len(here), len(runs), f"{100.0 * len(runs) / len(here):.1f} %", stops])
    report.show("programs that run", ["folder", "programs", "run", "share", "end in a protective stop"], rows)
    rest = [[one.name, " ".join(one.why.split())[:60]] for one in found if one.why]
    report.show("the rest", ["program", "why it does not run"], rest)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of folders of .script files")
    parser.add_argument("--seconds", type=float, default=30.0, help="of the controller's time, for each (%(default)g)")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    paths = sorted(args.folder.glob("*/**/*.script"))
    if not paths:
        parser.error(f"{args.folder} has no folder with .script files")
    enter_own_network()
    found = [run(args.folder, path, args.seconds) for path in paths]
    if args.json:
        print(json.dumps([one._asdict() for one in found]))
    else:
        print(report.head())
        show(found)
    return 0 if sum(not one.why for one in found) >= 0.9 * len(found) else 1
