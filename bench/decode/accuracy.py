"""Decoder against plants that share no code with it: error over the Cramer-Rao bound, certainty, run time.

    python -m bench decode                       # about an hour; the plants are kept and then cost nothing
    python -m bench decode --quick               # under a minute
    python -m bench decode --write               # also bench/RESULTS-decode.md and bench/decode.png

The sheets are solved by finite elements (tests.support.field.flat_plant, NGSolve), the circuit by nodal analysis
(converter_plant), the frames go as bytes into the stream of the tree at hand and of an older commit, each in a process
of its own, the same frames to both.
"""

from __future__ import annotations

# isort: split
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.field.flat_plant import FlatPlant

from . import cells as decode_cells
from . import disturbances as decode_disturbances
from . import fault_table as decode_fault_table
from . import several as decode_several
from . import tables as decode_tables
from .plants import RADII, SHEETS, STIFFNESSES, SolvedPlants, disc_cases
from .runs import ROOT, Decoder

OLD = "5a3f846"  # the commit whose decoder ../shared/design/decode.md measured
ALL = "cells,several,power,disturbances,collisions,time"
QUICK = "cells,several,power,disturbances,time"
RESULTS = Path(__file__).with_name("RESULTS-decode.md")
PICTURE = Path(__file__).with_name("decode.png")


def agreement(plants: SolvedPlants, places: int) -> dict[str, float]:
    """Return by sensor the largest difference of the plants from the exact field, over the largest conductance."""
    from coneskin.skin.field.model import FieldModel
    from coneskin.skin.field.sheet import SectorSheet

    worst = {}
    for name, plant in SHEETS.items():
        sheet = flat(plant, SectorSheet)
        model, largest = FieldModel(sheet, plant.upper, plant.lower), 0.0
        for case in (c for r in RADII for ka in STIFFNESSES for c in disc_cases(name, r, ka, places)):
            (patch,), ours = case.patches, plants.of(case)
            theirs = model.admittance(model.contacts(patch.u, patch.phi, patch.along, plant.conductance(patch)))[0]
            largest = max(largest, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
        worst[name] = largest
    return worst


def flat(plant: FlatPlant, kind: type) -> object:
    """Return the field model's sheet of a plant."""
    slope = (plant.radius2 - plant.radius1) / plant.slant
    return kind(plant.slant, slope / plant.radius1, plant.radius1 * plant.wrap, plant.wrap)


def ask(program: str, decoder: Decoder, count: int) -> dict[str, dict[str, Any]]:
    """Return what a program beside this one answers in the tree of a decoder."""
    with tempfile.TemporaryDirectory() as folder:
        answers = Path(folder) / "answers.json"
        command = [sys.executable, Path(__file__).with_name(program), str(count), answers]
        subprocess.run(command, env=os.environ | {"PYTHONPATH": str(decoder.tree / "src")}, check=True)
        return dict(json.loads(answers.read_text()))


def newest(given: str, cache: Path) -> Decoder:
    """Return the decoder that is judged."""
    if not given or Path(given).is_dir():
        return Decoder("now", Path(given).absolute() if given else ROOT)
    return Decoder.of_commit(given, cache)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few plants and cases, under a minute")
    parser.add_argument("--write", action="store_true", help="write RESULTS-decode.md and decode.png")
    parser.add_argument("--old", default=OLD, help="commit of the decoder beside today's")
    parser.add_argument("--new", default="", help="commit, or tree, of the decoder that is judged; the tree at hand")
    parser.add_argument("--several", type=int, help="presses by more than one contact")
    parser.add_argument("--collisions", type=int, default=300, help="collisions, end to end")
    parser.add_argument("--places", type=int, help="places in each cell")
    parser.add_argument("--draws", type=int, default=24, help="of the noise at each place")
    parser.add_argument("--parts", default="", help="what to measure")
    cache = Path(tempfile.gettempdir()) / "coneskin-bench-decode"
    parser.add_argument("--cache", type=Path, default=cache, help="folder of solved plants and old trees")
    args = parser.parse_args()
    import ngsolve

    ngsolve.SetNumThreads(1)
    args.cache.mkdir(exist_ok=True, parents=True)
    quick, parts = args.quick, (args.parts or (QUICK if args.quick else ALL)).split(",")
    plants = SolvedPlants(args.cache / "plants.jsonl")
    decoders = [Decoder.of_commit(args.old, args.cache), newest(args.new, args.cache)]
    places = args.places or (1 if quick else 6)
    report = decode_tables.Report([d.name for d in decoders])
    began = time.monotonic()

    def note(what: str) -> None:
        print(f"{time.monotonic() - began:6.0f} s  {what}", file=sys.stderr, flush=True)

    report.agreement(agreement(plants, 1 if quick else places))
    note(f"{plants.solved} plants solved")
    if "cells" in parts:
        grid = ((3e-3, 15e-3), (1.0, math.inf)) if quick else (RADII, STIFFNESSES)
        baselines = (0.0, 1e-2) if quick else decode_cells.BASELINES
        for sheet in ("UR5e",) if quick else ("UR5e", "paper"):
            for name in decode_cells.electronics(sheet):
                cells = decode_cells.measure(plants, decoders, sheet, name, baselines, places, args.draws, *grid)
                report.cells(cells)
                note(f"{sheet}, {name}")
    if "several" in parts:
        count = args.several or (64 if quick else 4000)
        for electric in ("16 bit, matched",) if quick else ("12 bit, 20 mA", "12 bit, matched", "16 bit, matched"):
            report.several(electric, decode_several.measure(plants, decoders, count, electric))
            note(f"several contacts, {electric}")
    if "power" in parts:
        report.power(decode_several.power(plants, decoders, 2 if quick else 2 * places, 4 if quick else 10))
        note("not one disc")
    if "disturbances" in parts:
        report.disturbances(decode_disturbances.measure(plants, decoders, 1 if quick else places))
        note("disturbances")
    if "collisions" in parts:
        report.collisions(ask("decode_collisions.py", decoders[-1], args.collisions))
        note("collisions")
    if "time" in parts:
        report.run_time(decode_disturbances.run_time(plants, decoders, 2 if quick else 7))
        note("run time")
    text = report.text()
    print(text)
    if args.write:
        RESULTS.write_text(text + decode_fault_table.section(RESULTS))
        report.draw(PICTURE)
    return 0
