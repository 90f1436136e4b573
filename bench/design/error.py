"""Error against run time of the map from (u, phi) to a point of a link, and of the fit that finds the cone.

    python -m bench design                       # about two minutes; every link of ../shared/data and a barrel
    python -m bench design --quick               # half a minute, one link and the barrel
    python -m bench design --long                # pyransac3d with 10 000 rounds too: minutes for each link
    python -m bench design --link my_link.stl    # a link of yours

Map: 20 000 random places of the first sheet, 5 mm from its ends; the reference is a ray along the cone's normal, its
depth on the face's plane in float64. "closest point" answers another question (nearest instead of along the normal), so
its error is what a guard would see of it. Places in holes deeper than the tolerance have no right answer and are left
out. Times are the best of several; ratios hold within one run only.

Fit: every method gets the samples of the hull that see the outside (trimesh: the corners). Axis and radius are compared
with our fit of 60 000 samples: tilt, shift amid the sheet, and d radius [mm]; rms is over the samples under that sheet.
trimesh and pyransac3d know cylinders only; the first bounds the whole link.
"""

from __future__ import annotations

import argparse
import math
import random
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
from coneskin.geometry.fit.cone_fit import InfiniteCone
from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.fit.fitted_sheet import FittedSheet
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import Mesh, load_mesh, make_mesh
from coneskin.geometry.ray_casting import RayCaster

Floats = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
LINKS = (
    "ur/ur10/collision/upperarm.stl",
    "ur/ur5e/visual/upperarm.dae",
    "ur/ur5e/visual/forearm.dae",
    "xarm/uf850_link4.stl",
)
GRIDS = ((32, 64), (64, 128), (128, 256), (256, 512))
PLACES = 20_000
TOLERANCE = 0.001


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
    u, phi = rng.uniform(0.005, f.slant - 0.005, PLACES), rng.uniform(0.0, f.wrap, PLACES)
    turn, shift = np.array(sheet.placed.link_frustum.rotation), np.array(sheet.placed.link_frustum.translation)
    feet, out = f.points(u, phi) @ turn.T + shift, f.normals(phi) @ turn.T
    rays = RayCaster(mesh)
    true = 0.02 - rays.cast(feet + 0.02 * out, -out)[0]
    sound = true > -TOLERANCE
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
    for rows, columns in GRIDS:
        start = time.perf_counter()
        grid = measure_displacement(mesh, sheet.placed, rows, columns, TOLERANCE, rays=rays)
        built = time.perf_counter() - start
        yield (
            f"cone + grid {rows}x{columns}",
            np.linalg.norm(grid.points(u, phi)[sound] - target, axis=1),
            best(partial(grid.point, 0.05, 2.0), 20_000),
            best(partial(grid.points, u[:1000], phi[:1000]), 20),
            best(partial(grid.points, many_u, many_phi), repeat=3),
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


# ---- the fit ----


def line_gap(origin: Floats, axis: Floats, sheet: FittedSheet) -> tuple[float, float]:
    """Tilt [deg] from a sheet's axis, and distance [mm] from it at the sheet's middle."""
    way = np.array(sheet.placed.link_frustum.rotation)[:, 2]
    middle = np.array(sheet.placed.link_frustum.apply((0.0, 0.0, 0.5 * sheet.frustum.height)))
    axis = axis / np.linalg.norm(axis)
    tilt = math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(axis, way))))))
    gap = middle - origin
    return tilt, 1e3 * float(np.linalg.norm(gap - (gap @ axis) * axis))


def fit_rows(
    mesh: Mesh, fine: FittedSheet, long: bool
) -> Iterator[tuple[str, float, float, float, float, float, float]]:
    """Name, samples, seconds, tilt [deg], shift [mm], radius error [mm], rms residual [mm]."""
    middle = 0.5 * (fine.frustum.radius1 + fine.frustum.radius2)
    hull = sample_surface(mesh, RayCaster(mesh))
    places = [fine.placed.locate((float(x), float(y), float(z))) for x, y, z in hull.points]
    under = hull.points[np.array([0.0 <= u <= fine.frustum.slant and abs(d) <= TOLERANCE for u, _, d in places])]

    def residual(origin: Floats, axis: Floats, radius: float, half_angle: float = 0.0) -> float:
        cone = InfiniteCone(origin, axis / np.linalg.norm(axis), radius, half_angle)
        return 1e3 * float(np.sqrt((cone.distances(under) ** 2).mean()))

    for count in (500, 1000, 2000, 6000, 20_000):
        seconds = best(partial(find_cones, mesh, tolerance=TOLERANCE, samples=count), repeat=3)
        fit = find_cones(mesh, tolerance=TOLERANCE, samples=count)
        if not fit.sheets:
            yield "coneskin", count, seconds, math.nan, math.nan, math.nan, math.nan
            continue
        sheet = fit.sheets[0]
        pose = sheet.placed.link_frustum
        origin, axis = np.array(pose.translation), np.array(pose.rotation)[:, 2]
        tilt, shift = line_gap(origin, axis, fine)
        radius = 0.5 * (sheet.frustum.radius1 + sheet.frustum.radius2)
        miss = residual(origin, axis, sheet.frustum.radius1, sheet.half_angle)
        yield "coneskin", count, seconds, tilt, shift, 1e3 * (radius - middle), miss
    import trimesh

    start = time.perf_counter()
    found = trimesh.bounds.minimum_cylinder(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False))
    seconds = time.perf_counter() - start
    origin, axis, radius = found["transform"][:3, 3], found["transform"][:3, 2], float(found["radius"])
    tilt, shift = line_gap(origin, axis, fine)
    yield (
        "trimesh minimum_cylinder",
        len(mesh.vertices),
        seconds,
        tilt,
        shift,
        1e3 * (radius - middle),
        residual(origin, axis, radius),
    )
    if find_spec("pyransac3d"):
        import pyransac3d  # type: ignore[import-untyped]

        random.seed(1)  # it draws from the global generators
        np.random.seed(1)
        for rounds in (1000, 10_000) if long else (1000,):
            start = time.perf_counter()
            result = pyransac3d.Cylinder().fit(hull.points, thresh=TOLERANCE, maxIteration=rounds)
            seconds = time.perf_counter() - start
            origin, axis, radius = np.asarray(result[0], float), np.asarray(result[1], float), float(result[2])
            tilt, shift = line_gap(origin, axis, fine)
            miss = residual(origin, axis, radius)
            yield f"pyransac3d {rounds} rounds", len(hull), seconds, tilt, shift, 1e3 * (radius - middle), miss


def print_fit(name: str, mesh: Mesh, fine: FittedSheet, long: bool) -> None:
    print(f"\nFIT  {name}: {len(mesh.faces)} faces")
    print(f"{'method':26}{'points':>8}{'ms':>9}{'tilt deg':>10}{'shift mm':>10}{'d radius':>11}{'rms mm':>9}")
    for label, count, seconds, tilt, shift, radius, rms in fit_rows(mesh, fine, long):
        print(f"{label:26}{count:8.0f}{seconds * 1e3:9.0f}{tilt:10.4f}{shift:10.4f}{radius:+11.4f}{rms:9.3f}")


def print_steps(name: str, path: Path) -> None:
    """From the file to the map, with the time of every step."""
    marks: list[tuple[str, float]] = [("reading the file", time.perf_counter())]
    mesh = load_mesh(path)
    fit = find_cones(mesh, tolerance=TOLERANCE, progress=lambda step: marks.append((step, time.perf_counter())))
    if fit.sheets:
        marks.append(("building the map", time.perf_counter()))
        measure_displacement(mesh, fit.sheets[0].placed)
    ends = [at for _, at in marks[1:]] + [time.perf_counter()]
    spent = ", ".join(f"{step} {(end - at) * 1e3:.0f} ms" for (step, at), end in zip(marks, ends, strict=True))
    print(f"\nSTEPS  {name}: {len(mesh.faces)} faces, {(ends[-1] - marks[0][1]) * 1e3:.0f} ms in all: {spent}")
    print(f"       {'sheets ' + str(len(fit.sheets)) if fit.sheets else 'refused: ' + fit.reason}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one link and the barrel")
    parser.add_argument("--long", action="store_true", help="pyransac3d with 10 000 rounds too")
    parser.add_argument("--link", type=Path, action="append", help="a mesh file instead of the shared links")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex", "pyransac3d"))
    files = arguments.link or [DATA / name for name in (LINKS[:1] if arguments.quick else LINKS)]
    there = [file for file in files if file.is_file()]
    for file in files:
        if file not in there:
            print(f"{file}: not there, left out")
    make_mesh(barrel().vertices, barrel().faces)  # warm up
    for file in [*there, *(() if arguments.link or arguments.quick else (DATA / "ur/ur5e/collision/forearm.stl",))]:
        if file.is_file():
            print_steps(file.name, file)
    bodies = [("/".join(file.parts[-3:]), load_mesh(file)) for file in there] + [("barrel", barrel())]
    for name, mesh in bodies:
        fit = find_cones(mesh, tolerance=TOLERANCE, samples=60_000)
        if not fit.sheets:
            print(f"\n{name}: {fit.reason}")
            continue
        print_map(name, mesh, fit)
        print_fit(name, mesh, fit.sheets[0], arguments.long)
