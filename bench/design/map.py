"""Error against run time of the map from (u, phi) to a point of a link.

    python -m bench design-map                # half a minute: a barrel that is made here
    python -m bench design-map LINK ...       # mesh files too, with the time of each step from the file to the map

Random places, 20 000 of the first sheet, 5 mm from its ends; the reference is a ray along the cone's normal, its
depth on the face's plane in float64. "closest point" answers another question (nearest instead of along the normal), so
its error is what a guard would see of it. Places in holes deeper than the tolerance have no right answer and are left
out. Times are the best of several; ratios hold within one run only.
"""

from __future__ import annotations

import argparse
import math
import time
import timeit
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.report import head
from coneskin.geometry.displacement_map import measure_displacement
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.mesh import Mesh, load_mesh, make_mesh
from coneskin.geometry.pose import Vector
from coneskin.geometry.ray_casting import RayCaster

Floats = NDArray[np.float64]

GRID_SIZES = ((32, 64), (64, 128), (128, 256), (256, 512))
PLACE_COUNT = 20_000
FIT_TOLERANCE = 0.001


def barrel() -> Mesh:
    """Return a tube of 50 mm that bulges by 3 mm: smooth, curved, 46 000 faces."""
    z = np.linspace(0.0, 0.3, 121)
    radius = 0.05 + 0.003 * np.sin(math.pi * z / 0.3)
    segments = 192
    phi = 2.0 * math.pi * np.arange(segments) / segments
    corners = np.stack(
        [np.outer(radius, np.cos(phi)), np.outer(radius, np.sin(phi)), np.repeat(z[:, None], segments, 1)], axis=2
    )
    k, j = (part.ravel() for part in np.meshgrid(np.arange(len(z) - 1), np.arange(segments), indexing="ij"))
    a, b = k * segments + j, k * segments + (j + 1) % segments
    faces = np.concatenate([np.stack([a, b, b + segments], 1), np.stack([a, b + segments, a + segments], 1)])
    return make_mesh(corners.reshape(-1, 3), faces, "barrel")


def best(call: Callable[[], Any], number: int = 1, repeat: int = 5) -> float:
    """Seconds of one call."""
    return min(timeit.repeat(call, number=number, repeat=repeat)) / number


# ---- the map ----


def map_rows(mesh: Mesh, sheet: FittedSheet) -> Iterator[tuple[str, Floats, float, float, float, float, float]]:
    """Name, errors [m], seconds of 1, 1000 and 1e6 places, seconds to build, bytes."""
    rng = np.random.default_rng(5)
    f = sheet.frustum
    u, phi = rng.uniform(0.005, f.slant - 0.005, PLACE_COUNT), rng.uniform(0.0, f.wrap, PLACE_COUNT)
    turn, shift = np.array(sheet.placed.link_frustum.rotation), np.array(sheet.placed.link_frustum.translation)
    feet, out = f.points(u, phi) @ turn.T + shift, f.normals(phi) @ turn.T
    rays = RayCaster(mesh)
    true = 0.02 - rays.cast(feet + 0.02 * out, -out)[0]
    sound = true > -FIT_TOLERANCE
    target = (feet + true[:, None] * out)[sound]
    many_u, many_phi = np.resize(u, 1_000_000), np.resize(phi, 1_000_000)

    def analytic(us: Floats, phis: Floats) -> Floats:
        return np.asarray(f.points(us, phis) @ turn.T + shift)

    yield (
        "cone alone",
        np.linalg.norm(feet[sound] - target, axis=1),
        best(partial(sheet.placed.point, 0.05, 2.0), 20_000),
        best(lambda: analytic(u[:1000], phi[:1000]), 20),
        best(lambda: analytic(many_u, many_phi), repeat=3),
        0.0,
        0.0,
    )
    for rows, columns in GRID_SIZES:
        start = time.perf_counter()
        grid = measure_displacement(mesh, sheet.placed, rows, columns, FIT_TOLERANCE, rays=rays)
        built = time.perf_counter() - start

        def many(us: Floats, phis: Floats, point: Callable[[float, float], Vector] = grid.point) -> Floats:
            return np.array(list(map(point, us.tolist(), phis.tolist())))

        yield (
            f"cone + grid {rows}x{columns}",
            np.linalg.norm(many(u, phi)[sound] - target, axis=1),
            best(partial(grid.point, 0.05, 2.0), 20_000),
            best(partial(many, u[:1000], phi[:1000]), 20),
            best(partial(many, many_u, many_phi), repeat=1),
            built,
            grid.heights.size * (8.0 + 32.0),  # the array, and the floats and pointers of the lists
        )

    def cast(us: Floats, phis: Floats) -> Floats:
        start, way = f.points(us, phis) @ turn.T + shift, f.normals(phis) @ turn.T
        depth = rays.cast(start + 0.02 * way, -way)[0]
        return np.asarray(start + (0.02 - depth)[:, None] * way)

    start = time.perf_counter()
    RayCaster(mesh).cast(feet[:1] + out[:1], -out[:1])
    built = time.perf_counter() - start
    yield (
        f"ray ({rays.engine})",
        np.linalg.norm(cast(u, phi)[sound] - target, axis=1),
        best(lambda: cast(u[:1], phi[:1]), 200),
        best(lambda: cast(u[:1000], phi[:1000]), 5),
        best(lambda: cast(many_u, many_phi), repeat=1),
        built,
        math.nan,
    )
    if find_spec("rtree"):
        import trimesh

        body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        start = time.perf_counter()
        trimesh.proximity.closest_point(body, feet[:1])
        built = time.perf_counter() - start
        nearest = trimesh.proximity.closest_point(body, feet[sound][:1000])[0]
        yield (
            "trimesh closest point",
            np.linalg.norm(nearest - target[:1000], axis=1),
            best(lambda: trimesh.proximity.closest_point(body, feet[:1]), 5),
            best(lambda: trimesh.proximity.closest_point(body, feet[:1000]), repeat=2),
            math.nan,
            built,
            math.nan,
        )


def print_map(name: str, mesh: Mesh, fit: LinkFit) -> None:
    sheet = fit.sheets[0]
    f = sheet.frustum
    print(
        f"\nMAP  {name}: {len(mesh.faces)} faces; sheet {1e3 * f.radius1:.2f} -> {1e3 * f.radius2:.2f} mm,"
        f" {1e3 * f.slant:.0f} mm long, {math.degrees(f.wrap):.0f} deg"
    )
    print(
        f"{'method':24}{'p50':>9}{'p99':>9}{'max mm':>9}{'1 us':>9}{'1e3 ms':>9}{'1e6 s':>8}{'build ms':>10}{'kB':>8}"
    )
    for label, errors, one, thousand, million, built, size in map_rows(mesh, sheet):
        mid, high, top = (1e3 * float(x) for x in (*np.percentile(errors, (50, 99)), errors.max()))
        print(
            f"{label:24}{mid:9.4f}{high:9.4f}{top:9.4f}{one * 1e6:9.2f}{thousand * 1e3:9.3f}"
            + (f"{million:8.3f}" if math.isfinite(million) else f"{'-':>8}")
            + f"{built * 1e3:10.1f}"
            + (f"{size / 1e3:8.0f}" if math.isfinite(size) else f"{'-':>8}")
        )


def print_steps(name: str, path: Path) -> None:
    """From the file to the map, with the time of every step."""
    marks: list[tuple[str, float]] = [("reading the file", time.perf_counter())]
    mesh = load_mesh(path)
    fit = find_cones(mesh, tolerance=FIT_TOLERANCE, progress=lambda step: marks.append((step, time.perf_counter())))
    if fit.sheets:
        marks.append(("building the map", time.perf_counter()))
        measure_displacement(mesh, fit.sheets[0].placed)
    ends = [at for _, at in marks[1:]] + [time.perf_counter()]
    spent = ", ".join(f"{step} {(end - at) * 1e3:.0f} ms" for (step, at), end in zip(marks, ends, strict=True))
    print(f"\nSTEPS  {name}: {len(mesh.faces)} faces, {(ends[-1] - marks[0][1]) * 1e3:.0f} ms in all: {spent}")
    print(f"       {'sheets ' + str(len(fit.sheets)) if fit.sheets else 'refused: ' + fit.reason}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", type=Path, nargs="*", metavar="LINK", help="mesh files")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex"))
    make_mesh(barrel().vertices, barrel().faces)  # warm up
    for file in arguments.links:
        print_steps(file.name, file)
    for name, mesh in [*((file.name, load_mesh(file)) for file in arguments.links), ("barrel", barrel())]:
        fit = find_cones(mesh, tolerance=FIT_TOLERANCE, samples=60_000)
        if fit.sheets:
            print_map(name, mesh, fit)
        else:
            print(f"\n{name}: {fit.reason}")
