"""Planted links that are not round: how much cones cover, how much developables do, and how far these are off.

    nice -n 19 python -m bench developable            # a minute: the tubes below, exact, faceted and noisy

Every tube is 200 mm high and closed by flat ends, which no sheet covers. Coverage is the share of the hull; distance
that of the fitted side from the planted one, which is known exactly, at 20 x 300 places.
Folded back: 2000 places of the flat pattern, to the side and back by the nearest foot.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from bench.report import head
from coneskin.geometry.fit.candidates import sample_link
from coneskin.geometry.fit.cones import fit_cones
from coneskin.geometry.fit.developable.packing import _with_developables
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.pose import Pose
from tests.support.ruled_tube import RuledTube, ellipse_section, rounded_box_section, stadium_section

TUBE_POSE = Pose.from_xyz_rpy((0.1, 0.2, -0.1), (0.5, -0.3, 0.8))
TUBE_SHAPES = {
    "circle": RuledTube(ellipse_section(0.05, 0.05), 0.2, pose=TUBE_POSE),
    "ellipse 1.05": RuledTube(ellipse_section(0.0525, 0.05), 0.2, pose=TUBE_POSE),
    "ellipse 1.2": RuledTube(ellipse_section(0.06, 0.05), 0.2, pose=TUBE_POSE),
    "ellipse 1.5": RuledTube(ellipse_section(0.06, 0.04), 0.2, pose=TUBE_POSE),
    "stadium": RuledTube(stadium_section(0.04, 0.04), 0.2, pose=TUBE_POSE),
    "rounded box": RuledTube(rounded_box_section(0.1, 0.07, 0.02), 0.2, pose=TUBE_POSE),
    "oblique cone": RuledTube(ellipse_section(0.06, 0.045), 0.2, (0.05, 0.0, 0.8), TUBE_POSE),
    "tapered box": RuledTube(rounded_box_section(0.1, 0.08, 0.025), 0.2, (0.0, 0.0, 1.2), TUBE_POSE),
}
MESH_KINDS = {"160 facets": (160, 8, 0.0), "48 facets": (48, 1, 0.0), "0.1 mm noise": (160, 40, 1e-4)}


def row(name: str, tube: RuledTube, kind: str) -> str:
    """Return one row of the table."""
    around, along, noise = MESH_KINDS[kind]
    mesh = tube.mesh(around, along, noise)
    start = time.perf_counter()
    options = FitOptions()
    link = sample_link(mesh, options, lambda _: None)
    cones = fit_cones(link, options, lambda _: None)
    middle = time.perf_counter()
    fit = _with_developables(link, cones, options)
    end = time.perf_counter()
    shares = [sum(sheet.area_share for sheet in found.sheets) for found in (cones, fit)]
    text = f"| {name} | {kind} | {shares[0]:.1%} | {shares[1]:.1%} "
    if not fit.sheets:
        return f"{text}| none | | | | | {middle - start:.1f} + {end - middle:.1f} |"
    placed = fit.sheets[0].placed
    side = placed.frustum
    u, phi = np.linspace(0.0, side.slant, 20)[:, None], np.linspace(0.0, side.wrap, 300)[None]
    off = tube.distances(placed.place(u, phi)[0].reshape(-1, 3))
    rng = np.random.default_rng(1)
    places = rng.random(2000) * side.slant, rng.random(2000) * side.wrap * 0.999
    back = placed.locate_all(placed.place(*places)[0])
    folded = max(float(np.abs(back[0] - places[0]).max()), float(np.abs(back[1] - places[1]).max()) * side.radius1)
    rms = math.sqrt(float((off**2).mean()))
    return (
        f"{text}| {placed.kind} | {1e3 * off.max():.3f} | {1e3 * rms:.3f} | {1e3 * placed.mismatch(4.75e-3):.3f} | "
        f"{1e3 * folded:.1e} | {middle - start:.1f} + {end - middle:.1f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mesh", choices=MESH_KINDS, action="append", help="kinds of mesh; by default all")
    args = parser.parse_args()
    print(head("numpy", "scipy"))
    print(
        "\n| link | mesh | cones cover | sheets cover | first sheet | distance, worst [mm] | rms [mm] | outer layer "
        "beside its sector [mm] | folded back [mm] | seconds, cones + developables |\n" + "|---" * 10 + "|"
    )
    for kind in args.mesh or MESH_KINDS:
        for name, tube in TUBE_SHAPES.items():
            print(row(name, tube, kind), flush=True)
