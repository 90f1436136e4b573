"""Random extreme sensors: is any error of the field solver above its tolerance without a word?

    python -m bench field-extremes                 # 2000 cases, about half an hour
    python -m bench field-extremes --cases 100 --seed 7

Sheet ratio 1e-6 to 1e6, r1/width 1e-6 to 10 (widening, narrowing, cylinders), sector angles to a full turn, radius from
1e-4 of the room to the edge, one disc or two, bonds and ka 1e-3 to 10, inputs of 1 to 1e18 ohm or open, tolerances 1e-4
to 1e-12. The reference is `tests.support.field.rim_solution`, at two densities of points; where it does not
settle (rims along an edge), the series at three times the order and nine times the points, also twice. Its circuit is
in 60 digits. A case without a settled reference counts for nothing, and is listed.
"""

from __future__ import annotations

# isort: split
import argparse
import math
import sys
import time
from collections import Counter
from typing import NamedTuple

import numpy as np

from bench.report import head, quantile, show
from coneskin.core.errors import FieldError
from coneskin.skin.field.disc import Disc, Discs, centre_distance
from coneskin.skin.field.fourport import Coupling, angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import solve_discs
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field.exact_circuit import exact_volts
from tests.support.field.rim_solution import solve_rims

ROUNDING_ERROR = 3e-13  # of the supply: what both sides' rounding may leave at these extremes


class Case(NamedTuple):
    """One random sensor with its contacts."""

    sheet: SectorSheet
    lower: float
    discs: tuple[Disc, ...]
    input_resistance: float
    tolerance: float

    @property
    def family(self) -> str:
        """What the case is."""
        kind = "bond" if any(math.isinf(d.conductance) for d in self.discs) else "finite"
        return f"{'one disc' if len(self.discs) == 1 else 'two discs'}, {kind}"


def random_case(rng: np.random.Generator) -> Case:
    """Draw a case; every extreme is as likely in each decade."""
    width, angle = 0.1, float(rng.uniform(0.05, 2.0 * math.pi))
    kind = rng.random()
    if kind < 0.7:
        sheet = SectorSheet.of_sector(width * 10.0 ** rng.uniform(-6.0, 1.0), width, angle)
    elif kind < 0.85:
        curvature = -(1.0 - 10.0 ** rng.uniform(-5.0, -0.05)) / width
        sheet = SectorSheet(width, curvature, min(width * 10.0 ** rng.uniform(-1.0, 0.5), angle / -curvature), 2.0)
    else:
        sheet = SectorSheet(width, 0.0, width * 10.0 ** rng.uniform(-1.5, 1.5), 2.0)
    lower = 10.0 ** rng.uniform(-6.0, 6.0)

    def part() -> float:
        small = 10.0 ** rng.uniform(-4.0, math.log10(0.5))
        return small if rng.random() < 0.6 else 1.0 - small

    along = part()
    u = float(sheet.locate(along * sheet.length, 0.0)[0]) if rng.random() < 0.5 else along * width
    phi = part() * sheet.wrap
    room = float(sheet.edge_distances(u, phi).min())
    gap = 10.0 ** rng.uniform(-4.0, 0.0)
    radius = room * (1.0 - 0.999 * gap) if rng.random() < 0.5 else 0.9999 * room * 10.0 ** rng.uniform(-4.0, 0.0)

    def conductance(a: float) -> float:
        return math.inf if rng.random() < 0.4 else (10.0 ** rng.uniform(-3.0, 1.0) / a) ** 2 / (1.0 + lower)

    discs = [Disc(u, phi, radius, conductance(radius))]
    if rng.random() < 0.25:
        for _ in range(20):  # a neighbour that fits, nearer than a few radii
            a = radius * 10.0 ** rng.uniform(-1.0, 0.5)
            apart = (radius + a) * (1.0 + 10.0 ** rng.uniform(-3.0, 1.0)) / float(sheet.stretch(u))
            turn = rng.uniform(0.0, 2.0 * math.pi)
            x = float(sheet.along(u)[0]) + apart * math.cos(turn)
            y = float(sheet.across(phi)[0]) + apart * math.sin(turn)
            if not (0.0 < x < sheet.length and 0.0 < y < sheet.breadth):
                continue
            u2, phi2 = (float(v) for v in sheet.locate(x, y))
            distance = float(centre_distance(sheet, *(np.array(v) for v in (u, phi, u2, phi2))))
            if a < float(sheet.edge_distances(u2, phi2).min()) and distance > (radius + a) * 1.0005:
                discs.append(Disc(u2, phi2, a, conductance(a)))
                break
    inputs = math.inf if rng.random() < 0.2 else 10.0 ** rng.uniform(0.0, 18.0)
    return Case(sheet, lower, tuple(discs), inputs, float(rng.choice([1e-4, 1e-6, 1e-9, 1e-12])))


def reference(case: Case, model: FieldModel, order: int) -> tuple[Coupling, str] | None:
    """Return a coupling that two resolutions agree upon, and whose it is, or None."""
    wanted = max(0.1 * case.tolerance, 0.5 * ROUNDING_ERROR)
    with np.errstate(all="ignore"):
        pair = [
            Coupling.of_matrix(solve_rims(case.sheet, 1.0, case.lower, case.discs, n)[None], np.zeros((1, 2)))
            for n in (16, 24)
        ]
    if agree(model, case, pair, wanted):
        return pair[1], "rims"
    scene = Discs(
        *(np.array([[getattr(d, name) for d in case.discs]]) for name in ("u", "phi", "radius", "conductance"))
    )
    high = min(3 * order, 432)
    try:
        series = [
            solve_discs(case.sheet, 1.0, case.lower, scene, m, 3 * m)[0] for m in (max(2 * high // 3, order), high)
        ]
    except np.linalg.LinAlgError:
        return None
    return (series[1], "series") if agree(model, case, series, wanted) else None


def agree(model: FieldModel, case: Case, pair: list[Coupling], wanted: float) -> bool:
    """Tell whether two resolutions give the same potentials; one that gives no contact at all has failed."""
    if not all(float(c.conductance[0]) > 0.0 for c in pair):
        return False
    return bool(np.abs(volts(model, case, pair[0]) - volts(model, case, pair[1])).max() < wanted)


def volts(model: FieldModel, case: Case, coupling: Coupling) -> np.ndarray:
    """Return the electrodes' potentials in both phases at 1 V."""
    phases = radial_phase(adc=case.input_resistance), angular_phase(adc=case.input_resistance)
    return np.array([model.read(coupling, phase).electrodes[0] for phase in phases])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "mpmath") + f"; seed {arguments.seed}")
    rng = np.random.default_rng(arguments.seed)
    counts: dict[str, Counter[str]] = {}
    spent: dict[str, list[float]] = {}
    worst: dict[str, float] = {}
    judged = number = unflagged = 0
    while judged < arguments.cases:
        case = random_case(rng)
        number += 1
        row = counts.setdefault(case.family, Counter())
        model = FieldModel(case.sheet, 1.0, case.lower, case.tolerance)
        start = time.process_time()
        try:
            found = model.discs(case.discs)
        except FieldError:
            row["refused"] += 1
            judged += 1
            spent.setdefault(case.family, []).append(time.process_time() - start)
            continue
        spent.setdefault(case.family, []).append(time.process_time() - start)
        if (settled := reference(case, model, 128)) is None:
            row["no reference"] += 1
            continue
        true, kind = settled
        phases = radial_phase(adc=case.input_resistance), angular_phase(adc=case.input_resistance)
        exact = np.array([[float(v) for v in exact_volts(true, model, phase)] for phase in phases])
        error = float(np.abs(volts(model, case, found) - exact).max())
        judged += 1
        row[kind] += 1
        over = error / max(case.tolerance, ROUNDING_ERROR)
        worst[case.family] = max(worst.get(case.family, 0.0), over)
        if over > 1.0:
            row["above"] += 1
            unflagged += 1
            print(f"UNFLAGGED {error:.2e} (estimate {found.error[0]:.1e}) by {kind}: {case}", flush=True)
        if judged % 100 == 0:
            print(f"{judged} of {number}: {unflagged} above", file=sys.stderr, flush=True)
    columns = ["contacts", "solved, by rims", "by the series", "worst error/tolerance", "above it", "refused"]
    columns += ["no reference", "time, median", "99 %"]
    rows = []
    for family, row in sorted(counts.items()):
        times = sorted(spent[family])
        rows.append(
            [family, str(row["rims"]), str(row["series"]), f"{worst.get(family, 0.0):.2g}", str(row["above"])]
            + [str(row["refused"]), str(row["no reference"])]
            + [f"{1e3 * quantile(times, share):.3g} ms" for share in (0.5, 0.99)]
        )
    show("random extreme sensors", columns, rows)
    print(f"{judged} cases judged of {number}; errors above the tolerance without a word: {unflagged}")
    return 1 if unflagged else 0
