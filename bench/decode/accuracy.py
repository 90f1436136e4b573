"""Decoder against plants that share no code with it: error over the Cramer-Rao bound, certainty, run time.

    python -m bench decode                       # about an hour; the plants are kept and then cost nothing
    python -m bench decode --quick               # under a minute

The sheets are solved by finite elements (tests.support.field.flat_plant, NGSolve), the circuit by nodal analysis
(converter_plant), and the frames go as bytes into a stream.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.report import head, show
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field.flat_plant import FlatPlant

from . import cells, disturbances, several, tables
from .collisions import collide
from .plants import RADII, SHEETS, STIFFNESSES, SolvedPlants, disc_cases

ALL_PARTS = "cells,several,power,disturbances,collisions,time"
QUICK_PARTS = "cells,several,power,disturbances,time"


def agreement(plants: SolvedPlants, places: int) -> dict[str, float]:
    """Return by sensor the largest difference of the plants from the exact field, over the largest conductance."""
    worst = {}
    for name, plant in SHEETS.items():
        sheet = flat(plant)
        model, largest = FieldModel(sheet, plant.upper, plant.lower), 0.0
        for case in (c for r in RADII for ka in STIFFNESSES for c in disc_cases(name, r, ka, places)):
            (patch,), ours = case.patches, plants.of(case)
            theirs = model.admittance(model.contacts(patch.u, patch.phi, patch.along, plant.conductance(patch)))[0]
            largest = max(largest, float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
        worst[name] = largest
    return worst


def flat(plant: FlatPlant) -> SectorSheet:
    """Return the field model's sheet of a plant."""
    slope = (plant.radius2 - plant.radius1) / plant.slant
    return SectorSheet(plant.slant, slope / plant.radius1, plant.radius1 * plant.wrap, plant.wrap)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few plants and cases, under a minute")
    parser.add_argument("--several", type=int, help="presses by more than one contact")
    parser.add_argument("--electronics", help="with which alone these are measured")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--collisions", type=int, default=300, help="collisions, end to end (%(default)s)")
    parser.add_argument("--places", type=int, help="places in each cell")
    parser.add_argument("--draws", type=int, default=24, help="of the noise at each place (%(default)s)")
    parser.add_argument("--parts", default="", help=f"what to measure ({ALL_PARTS})")
    cache = Path(tempfile.gettempdir()) / "coneskin-bench-decode"
    parser.add_argument("--cache", type=Path, default=cache, help="folder of solved plants (%(default)s)")
    args = parser.parse_args()
    import ngsolve

    ngsolve.SetNumThreads(1)
    args.cache.mkdir(exist_ok=True, parents=True)
    quick, parts = args.quick, (args.parts or (QUICK_PARTS if args.quick else ALL_PARTS)).split(",")
    plants = SolvedPlants(args.cache / "plants.jsonl")
    places = args.places or (1 if quick else 6)
    goals: list[list[str]] = []
    began = time.monotonic()

    def note(what: str) -> None:
        print(f"{time.monotonic() - began:6.0f} s  {what}", file=sys.stderr, flush=True)

    print(head("numpy", "ngsolve"))
    worst = [[name, f"{value:.1e}"] for name, value in agreement(plants, 1 if quick else places).items()]
    show("plants against the exact field: largest difference of Y, over its largest entry", ["sensor", "worst"], worst)
    note(f"{plants.solved} plants solved")
    if "cells" in parts:
        grid = ((3e-3, 15e-3), (1.0, math.inf)) if quick else (RADII, STIFFNESSES)
        baselines = (0.0, 1e-2) if quick else cells.BASELINE_DRIFTS
        found = []
        for sheet in ("UR5e",) if quick else ("UR5e", "paper"):
            for name in cells.electronics(sheet):
                found += cells.measure(plants, sheet, name, baselines, places, args.draws, *grid)
                note(f"{sheet}, {name}")
        goals += tables.show_cells(found)
    if "several" in parts:
        count = args.several or (64 if quick else 4000)
        every = ("16 bit, matched",) if quick else ("12 bit, 20 mA", "12 bit, matched", "16 bit, matched")
        for electric in (args.electronics,) if args.electronics else every:
            goals.append(tables.show_several(electric, several.measure(plants, count, electric, args.first)))
            note(f"several contacts, {electric}")
    if "power" in parts:
        tables.show_power(several.power(plants, 2 if quick else 2 * places, 4 if quick else 10))
        note("not one disc")
    if "disturbances" in parts:
        tables.show_disturbances(disturbances.measure(plants, 1 if quick else places))
        note("disturbances")
    if "collisions" in parts:
        columns = ["collision", "cases", "moved away", "towards", "worst [mm]", "seeds"]
        show("retreats that move towards a body by 2 mm more than a bare stop", columns, collide(args.collisions))
        note("collisions")
    if "time" in parts:
        goals.append(tables.show_run_time(disturbances.run_time(plants, 2 if quick else 7)))
        note("run time")
    tables.show_goals(goals)
    return 0
