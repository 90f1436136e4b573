"""The same surface, the same sheets: area found on copies of a link that are one surface to a hand.

    python -m bench design-copies LINK ...           # three sheets at most; five searches for each link
    python -m bench design-copies --only noisy LINK ...
    python -m bench design-copies --samples LINK ... # no search, which draws nothing: the samples that it begins with

Copies: elsewhere (mirrored, rotated and moved, with the faces in another order, at once); refined (a corner amid every
edge); noisy, corners displaced by 0.1 mm (root mean square); decimated (the refined one, down to the link's own number
of faces, by fast_simplification, which moves the surface by "off mm", root mean square; left out without it).

A column is the area of the sheets of a copy over that of the link as it is, less 1, in percent; "apart" is the largest
difference between any two, over their median. "of hull" is the same as a share of the hull. "cpu s" is the median of
the searches. With --samples a column is the largest distance of a sample of a copy from the nearest of the link as it
is, each in the frame of its own surface, in micrometers; and the median one.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from bench.report import head, show
from coneskin.core.errors import MeshError
from coneskin.geometry.fit.cones import find_cones
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import Mesh, load_mesh, make_mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster

NOISE = 1e-4  # m
TURN = Pose.from_xyz_rpy((0.3, -0.2, 0.1), (0.4, -0.7, 1.1))
KINDS = ("as is", "elsewhere", "refined", "noisy", "decimated")


def copies(mesh: Mesh) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the copies of a link: name, corners and faces."""
    rng = np.random.default_rng(0)
    v, f = mesh.vertices, mesh.faces
    yield "as is", v, f
    yield "elsewhere", TURN.apply_all(v * [-1.0, 1.0, 1.0]), rng.permutation(f)[:, ::-1]
    a, b, c = v[f].transpose(1, 0, 2)
    n, k, i = len(v), len(f), np.arange(len(f))
    ab, bc, ca = n + i, n + k + i, n + 2 * k + i
    four = ((f[:, 0], ab, ca), (ab, f[:, 1], bc), (ca, bc, f[:, 2]), (ab, bc, ca))
    corners = np.concatenate([v, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)])
    fine = np.concatenate([np.stack(part, 1) for part in four])
    yield "refined", corners, fine
    yield "noisy", v + rng.normal(0.0, NOISE / 3**0.5, v.shape), f
    if find_spec("fast_simplification"):
        from fast_simplification import simplify  # type: ignore[import-not-found]

        whole = make_mesh(corners, fine)  # welded, or it falls apart; in millimeters, which its float32 needs
        few, faces = simplify((1e3 * whole.vertices).astype(np.float32), whole.faces.astype(np.int32), 0.75, agg=3)
        yield "decimated", 1e-3 * few.astype(float), faces


def apart_by(mesh: Mesh, other: Mesh) -> float:
    """Return the distance between two surfaces along the normals of one [m], root mean square."""
    hull = sample_surface(mesh, RayCaster(mesh))
    off = RayCaster(other).cast(hull.points + 0.01 * hull.normals, -hull.normals)[0] - 0.01
    return float(np.sqrt((off[np.abs(off) < 0.005] ** 2).mean()))


def seen(mesh: Mesh) -> np.ndarray:
    """Return the samples of a hull in the frame of its own surface [m], shape (n, 3)."""
    middle, ways = mesh.own_frame
    return np.asarray((sample_surface(mesh, RayCaster(mesh)).points - middle) @ ways)


def show_samples(links: list[Path], kinds: list[str]) -> None:
    """Print how far the samples of copies are from those of the links."""
    rows = []
    for path in links:
        cells: dict[str, str] = {}
        own = np.empty((0, 3))
        for kind, corners, faces in copies(load_mesh(path)):
            if kind not in ("as is", *kinds):
                continue
            places = seen(make_mesh(np.ascontiguousarray(corners, float), np.ascontiguousarray(faces), path.name))
            own = places if kind == "as is" else own
            off = 1e6 * cKDTree(own).query(places)[0]
            cells[kind] = f"{off.max():.2g}, {np.median(off):.2g}"
        rows.append([path.name, *(cells[kind] for kind in kinds if kind in cells)])
    show("samples of copies, um: largest distance and median", ["link", *kinds], rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", nargs="+", type=Path, metavar="LINK")
    parser.add_argument("--sheets", type=int, default=3, help="sheets at most (default 3)")
    parser.add_argument("--only", action="append", choices=KINDS[1:], help="only these copies")
    parser.add_argument("--samples", action="store_true", help="no search, only the samples that it begins with")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex", "fast_simplification"))
    if arguments.samples:
        show_samples(arguments.links, arguments.only or list(KINDS[1:]))
        return
    rows, worst, apart = [], dict.fromkeys(KINDS, 0), []
    for path in arguments.links:
        try:
            link = load_mesh(path)
        except MeshError:  # metres by its header, and 200 of them
            link = load_mesh(path, "mm")
        areas, spent, hull, moved = {}, [], 0.0, math.nan
        for kind, corners, faces in copies(link):
            if arguments.only and kind not in ("as is", *arguments.only):
                continue
            mesh = make_mesh(np.ascontiguousarray(corners, float), np.ascontiguousarray(faces), path.name)
            start = time.process_time()
            fit = find_cones(mesh, max_sheets=arguments.sheets, allow_hull=True)
            spent.append(time.process_time() - start)
            areas[kind] = sum(sheet.frustum.area for sheet in fit.sheets)
            hull = hull or fit.hull_area
            moved = apart_by(link, mesh) if kind == "decimated" else moved
        middle, own = statistics.median(areas.values()), areas["as is"]
        off = max(areas.values()) - min(areas.values())
        apart.append(off / middle if middle else 0.0)
        for kind, area in areas.items():
            worst[kind] += abs(area - own) > 0.02 * own
        changes = [f"{100 * (areas[kind] / own - 1):+.1f}" if kind in areas and own else "-" for kind in KINDS[1:]]
        row = [path.name, f"{own / hull:.3f}", *changes, f"{100 * apart[-1]:.1f}", f"{100 * off / hull:.1f}"]
        rows.append([*row, f"{1e3 * moved:.2f}", f"{statistics.median(spent):.1f}"])
        print(*rows[-1], flush=True)
    title = f"{sum(one <= 0.02 for one in apart)} of {len(apart)} links within 2 %"
    last = ["beyond 2 %", "", *(worst[kind] for kind in KINDS[1:]), f"{100 * statistics.median(apart):.1f}", "", "", ""]
    show(title, ["link", "area", *KINDS[1:], "apart", "of hull", "off mm", "cpu s"], [*rows, last])
