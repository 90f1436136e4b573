"""Coverage of links by the sheets found on them, against a bound by brute force.

    python -m bench design-links LINK ...        # meshes of yours; a minute for each, nearly all of it for the bound
    python -m bench design-links --sheets 4 --no-bound LINK ...

The bound: hypotheses of cones from many draws; each is fitted with every gate, and a line of revolution is looked for
from each. All axes that are left, up to hundreds, are surveyed; packings are grown from sixteen starts that lie apart,
and the best four are made on fine profiles and completed, as what is found is. So the bound is sheets that exist: the
best of them and of what is found. It shows what the search misses by trying few axes, few starts and few packings; it
shares the rules of packing, so it does not show what these miss. "area" is the sheets over the hull, for both.

An earlier bound was no bound: it kept the first 250 axes of the first draws, grew from five starts that were mostly one
axis again, and compared areas of whole coarse cells with those of finished sheets, a tenth too much for a short sheet.

Meshes of makers that are not in ../shared/data, all of licences that permit it (fetched, not stored here): Franka
(franka_description b299b39, Apache-2.0), Doosan (doosan-robot ab24968, BSD-3), FANUC (fanuc 8fee5e3, BSD-3), KUKA
(kuka_experimental e78bbd1, Apache-2.0), ABB (abb 77db19b, BSD-3 and Apache-2.0), Kinova (ros_kortex 6cd75d4, BSD-3),
Staubli (staubli 367d92e, Apache-2.0).
"""

from __future__ import annotations

import argparse
import math
import resource
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.report import head
from coneskin.core.errors import MeshError
from coneskin.geometry.fit import candidates as hypotheses
from coneskin.geometry.fit.axis_plan import SheetRequirements, fitted_sheet
from coneskin.geometry.fit.candidates import AxisCandidate, SampledLink, _find_revolution_axis
from coneskin.geometry.fit.coarse_packing import Choice, grown, survey_axes
from coneskin.geometry.fit.cone_fit import fit_cone
from coneskin.geometry.fit.cones import LEAST_GAIN, FineStage, find_cones
from coneskin.geometry.fit.surface_samples import SurfaceSamples, sample_surface
from coneskin.geometry.mesh import Mesh, load_mesh
from coneskin.geometry.ray_casting import RayCaster

FIT_TOLERANCE = 0.001
SEARCH_SEEDS = 3
MAX_AXES = 200  # the most often found
START_COUNT = 16  # packings
FINE_PACKINGS = 4  # packings made on fine profiles
MIN_APART = (math.radians(0.5), 0.001)  # rad, m: starts about axes nearer to each other are one


def brute_axes(samples: SurfaceSamples) -> list[AxisCandidate]:
    """Every axis that many draws give, told apart by a twentieth of a degree and a twentieth of a millimetre."""
    found: dict[tuple[int, ...], AxisCandidate] = {}
    times: Counter[tuple[int, ...]] = Counter()

    def add(origin: np.ndarray, axis: np.ndarray, cones: tuple) -> None:  # type: ignore[type-arg]
        axis = axis * math.copysign(1.0, axis[int(np.abs(axis).argmax())])
        foot = origin - ((origin - middle) @ axis) * axis
        key = tuple(np.round(axis / 1e-3).astype(int)) + tuple(np.round(foot / 5e-5).astype(int))
        known = found.get(key)
        times[key] += 1
        if known is None or len(known.cones) < 4:
            found[key] = AxisCandidate(foot, axis, (known.cones if known else ()) + cones)

    middle = samples.points.mean(axis=0)
    size = float(np.ptp(samples.points, axis=0).max())
    for seed in range(10, 10 + SEARCH_SEEDS):
        for distance in (0.001, max(0.0015, 0.004 * size)):
            for start in hypotheses._cone_hypotheses(samples, distance, 20, seed):
                line = _find_revolution_axis(samples, (start.origin, start.axis))
                if line is not None:
                    add(*line, ())
                wide = max(0.006, 0.06 * start.radius)
                for gates in ((0.002, 0.0005), (0.002,), (0.001,), (0.005,)):
                    cone = fit_cone(samples, start, (wide, *gates))
                    if cone is not None:
                        sign = math.copysign(1.0, cone.axis[int(np.abs(cone.axis).argmax())])
                        add(
                            cone.origin,
                            cone.axis,
                            (replace(cone, axis=sign * cone.axis, half_angle=sign * cone.half_angle),),
                        )
    return [found[key] for key, _ in times.most_common(MAX_AXES)]


def starts_apart(singles: list[Choice]) -> list[Choice]:
    """The best plans about one axis each, no two of as many sheets about nearly one axis."""
    kept: list[Choice] = []
    for one in singles:
        frame = one.plan.profile.frame
        for other in kept:
            there = other.plan.profile.frame
            gap = frame.origin - there.origin
            tilt = float(np.linalg.norm(np.cross(frame.axis, there.axis)))
            shift = float(np.linalg.norm(gap - (gap @ there.axis) * there.axis))
            if tilt < MIN_APART[0] and shift < MIN_APART[1] and len(other.plan.sides) == len(one.plan.sides):
                break
        else:
            kept.append(one)
        if len(kept) == START_COUNT:
            break
    return kept


def bound(mesh: Mesh, sheets: int) -> tuple[float, int]:
    """Area of the best packing over the area of the hull, and the number of axes tried."""
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, 12_000)
    whole = len(hull) * hull.area
    wanted = SheetRequirements(FIT_TOLERANCE, sheets, least_gain=LEAST_GAIN * whole)
    axes = brute_axes(hull)
    link = SampledLink(mesh, rays, hull, hull, None, axes)
    surveys = survey_axes(link, wanted)
    stage = FineStage(link, surveys, wanted)
    loose, alone = wanted.loose, stage.alone
    singles = [Choice(number, one) for number, plans in enumerate(alone) for one in plans]
    singles.sort(key=lambda choice: -choice.plan.score(loose))
    packings = [grown([start], surveys, alone, loose) for start in starts_apart(singles)]
    packings.sort(key=lambda packing: -sum(choice.plan.score(loose) for choice in packing))
    best = 0.0
    for packing in packings[:FINE_PACKINGS]:
        made = stage.completed(stage.made(packing))
        fitted = [
            fitted_sheet(about, side, 0, hull, FIT_TOLERANCE, wanted.seam) for about in made for side in about.sides
        ]
        best = max(best, sum(sheet.frustum.area for sheet in fitted))
    return best / whole, len(axes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", nargs="+", type=Path, metavar="LINK")
    parser.add_argument("--sheets", type=int, default=3, help="sheets at most (default 3)")
    parser.add_argument("--no-bound", action="store_true", help="only what is found, and its time")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex"))
    columns = {"link": -22, "faces": 9, "cpu s": 7, "MB": 6, "sheets": 7, "axes": 5, "area": 7, "bound": 7, "ratio": 7}
    print(
        "".join(f"{name:<{-width}}" if width < 0 else f"{name:>{width}}" for name, width in columns.items()) + "   of"
    )
    for path in arguments.links:
        try:
            mesh = load_mesh(path)
        except MeshError:  # metres by its header, and 200 of them
            mesh = load_mesh(path, "mm")
        start = time.process_time()
        fit = find_cones(mesh, tolerance=FIT_TOLERANCE, max_sheets=arguments.sheets)
        spent = time.process_time() - start
        area = sum(sheet.frustum.area for sheet in fit.sheets) / fit.hull_area
        top = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        line = f"{path.name:22}{len(mesh.faces):9}{spent:7.2f}{top:6.0f}{len(fit.sheets):7}"
        line += f"{len({sheet.axis for sheet in fit.sheets}):5}{area:7.3f}"
        if not arguments.no_bound:
            most, tried = bound(mesh, arguments.sheets)
            most = max(most, area)
            line += f"{most:7.3f}{area / most if most else math.nan:7.3f}{tried:5}"
        print(line + ("" if fit.sheets else f"  refused: {fit.reason[:60]}"), flush=True)
