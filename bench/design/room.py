"""Room for sensing: a bound of the share of a link in which any cone sheets could locate a touch.

    python -m bench design-room LINK ...    # some seconds for each

A place is "within reach" if it lies within the tolerance of a cone that is within it over some patch of at least 25 mm
by 150 deg around the place; and "inside rims" if such a patch leaves it beyond the narrowest margin and electrode, 5 mm
from each end and edge, or from the ends of a full turn. Any number of sheets, over each other; no tabs, no leads, no
seam, no wires. Cones: about all axes of the search and near all its lines, moved by up to a tolerance. What the search
never looks at is not in it, so it is a bound of the placing, not of the axes.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion

from bench.report import head, show
from coneskin.core.errors import MeshError
from coneskin.geometry.drawing.electrode_layout import NARROWEST_PLAN
from coneskin.geometry.fit.axis_plan import SheetRequirements
from coneskin.geometry.fit.candidates import SampledLink, sample_link
from coneskin.geometry.fit.coarse_packing import AxisSurvey, better_surveys, survey_axes
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.mesh import load_mesh

RIM = NARROWEST_PLAN.margin + NARROWEST_PLAN.electrode
SHIFTS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # of a line, in tolerances


def patches(good: np.ndarray, rows: int, columns: int, cut: tuple[int, int]) -> np.ndarray:
    """Return the cells of all patches of so many good rows and columns, less a border of so many cells."""
    around = good.shape[1]
    inner = max(1, rows - 2 * cut[0]), max(1, columns - 2 * cut[1])
    found = np.tile(good, 3)
    for change, (high, wide) in ((binary_erosion, (rows, columns)), (binary_dilation, inner)):
        found = change(change(found, np.ones((high, 1))), np.ones((1, wide)))
    return found[:, :around] | found[:, around : 2 * around] | found[:, 2 * around :]


def within(link: SampledLink, survey: AxisSurvey, wanted: SheetRequirements) -> tuple[np.ndarray, np.ndarray]:
    """Return which samples of a hull are within reach of cones about an axis, and which inside their rims."""
    profile = survey.profile
    around = len(profile.phi)
    rows = math.ceil(wanted.min_length / profile.step)
    columns = math.ceil(wanted.min_wrap / math.tau * around)
    x, y, z = profile.frame.local(link.hull.points).T
    row = np.clip(((z - profile.z[0]) / profile.step + 0.5).astype(int), 0, len(profile.z) - 1)
    column = np.round(np.arctan2(y, x) / math.tau * around).astype(int) % around
    covered, sensed = np.zeros(len(x), bool), np.zeros(len(x), bool)
    floor = profile.floor(wanted.tolerance)
    for radius, slope in survey.lines:
        for shift in SHIFTS:
            line = radius + shift * wanted.tolerance + slope * profile.z
            limit = wanted.tolerance * math.hypot(1.0, slope)
            good = (profile.radius <= line[:, None] + limit) & (floor >= line[:, None] - limit)
            good &= (line > wanted.min_radius)[:, None]
            if good.sum() < rows * columns:
                continue
            cut = int(RIM / profile.step), int(RIM / (math.tau / around * max(float(line.max()), 1e-3)))
            near = np.abs(np.hypot(x, y) - line[row]) <= 1.5 * limit
            turns = np.repeat(good.all(axis=1)[:, None], around, axis=1)
            covered |= near & patches(good, rows, columns, (0, 0))[row, column]
            inside = patches(good, rows, columns, cut) | patches(turns, rows, around, (cut[0], 0))
            sensed |= near & inside[row, column]
    return covered, sensed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", nargs="+", type=Path, metavar="LINK")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex"))
    rows, shares = [], []
    for path in arguments.links:
        start = time.process_time()
        try:
            link = sample_link(load_mesh(path), FitOptions(), lambda _: None)
        except MeshError:  # metres by its header, and 200 of them
            link = sample_link(load_mesh(path, "mm"), FitOptions(), lambda _: None)
        wanted = SheetRequirements()
        surveys = survey_axes(link, wanted)
        surveys += better_surveys(link, surveys, replace(wanted, max_sheets=3))
        pairs = [within(link, survey, wanted) for survey in surveys]
        share = [float(np.logical_or.reduce(part).mean()) for part in zip(*pairs, strict=True)]
        shares.append(share)
        rows.append([path.name, *(f"{one:.3f}" for one in share), f"{time.process_time() - start:.1f}"])
        print(*rows[-1], flush=True)
    medians = (f"{statistics.median(part):.3f}" for part in zip(*shares, strict=True))
    show("share of the hull", ["link", "within reach", "inside rims", "cpu s"], [*rows, ["median", *medians, ""]])
