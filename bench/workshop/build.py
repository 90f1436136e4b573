"""What a workshop builds: the jig's distance to real links, STEP read back by another reader, and the blind seam.

python -m pip install -e '.[design,cad,bench]'; python -m bench build --links FOLDER > build.txt

A link takes a minute or more. A run that was ended goes on with `--resume build.txt > build-2.txt`: the links that are
whole there are taken over, each with the commit and load of its run.

The links: meshes of the makers, all of licences that permit it (fetched, not stored here): Franka (franka_description
b299b39, Apache-2.0), Doosan (doosan-robot ab24968, BSD-3), FANUC (fanuc 8fee5e3, BSD-3), KUKA (kuka_experimental
e78bbd1, Apache-2.0), ABB (abb 77db19b, BSD-3 and Apache-2.0), Kinova (ros_kortex 6cd75d4, BSD-3), Staubli (staubli
367d92e, Apache-2.0), Universal Robots (Universal_Robots_ROS2_Description 2221ec0, BSD-3) and UFactory (xarm_ros2
3654ba7, BSD-3).
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import KDTree

import coneskin as cs
from bench.report import head
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, _blind_angle, cover_seams, design_sheets
from coneskin.design.workshop.jig import Collar, jig_collars, with_sheets
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.geometry.solid import WrappedLayer, write_step

SAMPLE_COUNT = 40_000  # on the faces of a link beside a part, and on the part
NEAREST_COUNT = 800  # of them whose distance is computed
_DONE_MARK = "; done"  # ends the last row of a link


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=Path, help="folder of link meshes")
    parser.add_argument("--resume", type=Path, help="output of an earlier run, whose finished links are taken over")
    args = parser.parse_args()
    earlier = _finished(args.resume.read_text()) if args.resume else {}
    this = head("trimesh", "cadquery-ocp-novtk", "gmsh")
    print(this, flush=True)
    print("\nblind angle of a full wrap [deg]; strip: its own four wires")
    seams()
    print("\nSTEP: distance of the surfaces that gmsh reads from the exact ones [m]")
    step()
    if args.links:
        print("\njig: distance of link and sheets that it bears already from the printed part [mm]; clearance 0.3 mm")
        paths = sorted([*args.links.rglob("*.dae"), *args.links.rglob("*.stl")])
        for number, path in enumerate(paths, 1):
            name = path.relative_to(args.links).as_posix()
            print(f"link {number} of {len(paths)}: {name}", file=sys.stderr, flush=True)
            began = time.perf_counter()
            rows = earlier.get(name)
            if rows is None:
                rows = [
                    *jig(path),
                    f"  {name}: {time.perf_counter() - began:.0f} s, {this.splitlines()[-1]}{_DONE_MARK}",
                ]
            print("\n".join(rows), flush=True)


def _finished(text: str) -> dict[str, list[str]]:
    """Return the rows of each link that an earlier output has whole, by the link's name."""
    links: dict[str, list[str]] = {}
    rows: list[str] = []
    for line in text.split("from the printed part", 1)[-1].splitlines()[1:]:
        rows.append(line)
        if line.endswith(_DONE_MARK):
            links[line.split(": ")[0].strip()] = rows
            rows = []
    return links


def seams() -> None:
    narrow = ElectrodePlan(margin=4e-3, electrode=3e-3, lead=3e-3, clearance=1e-3, hole=0.0)
    rows = {"default": DesignOptions(plan=ElectrodePlan()), "narrow electrodes": DesignOptions(plan=narrow)}
    rows["flap of 10 mm"] = DesignOptions(plan=ElectrodePlan(), overlap=10e-3)
    rows["strip"] = DesignOptions(plan=ElectrodePlan(), cover_seam=True)
    rows["strip, narrow"] = DesignOptions(plan=narrow, cover_seam=True)
    for radius in (0.0375, 0.054, 0.075):
        for name, options in rows.items():
            sheets = cover_seams(design_sheets([PlacedFrustum(Frustum(radius, radius, 0.2))], options))
            print(f"  radius {1e3 * radius:5.1f} mm  {name:18} {math.degrees(_blind(sheets)):6.2f}")


def _blind(sheets: tuple[SheetDesign, ...], steps: int = 36_000) -> float:
    """Return the angle at the middle of the link where no sheet locates a touch [rad]: each azimuth is looked at."""
    phi = np.arange(steps) * 2.0 * math.pi / steps
    seen = np.zeros(steps, bool)
    for sheet in sheets:
        spin = sheets[0].place.link_frustum.inverse() @ sheet.place.link_frustum
        x, y, _ = spin.rotate((1.0, 0.0, 0.0))
        local = (phi - math.atan2(y, x)) % (2.0 * math.pi)
        box = sheet.layout.active
        seen |= (local >= box.phi1 - 1e-9) & (local <= box.phi2 + 1e-9)
    assert len(sheets) > 1 or abs(float((~seen).mean()) * 2.0 * math.pi - _blind_angle(sheets[0])) < 1e-3
    return float((~seen).mean()) * 2.0 * math.pi


def step() -> None:
    import gmsh

    pose = Pose.from_xyz_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    for name, side in {
        "cone": Frustum(0.05, 0.07, 0.15, math.radians(300.0)),
        "cylinder": Frustum(0.054, 0.054, 0.4),
        "slender cone": Frustum(0.05, 0.0501, 0.3),
        "disc": Frustum(0.03, 0.1, 0.005, math.radians(200.0)),
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "sheet.step"
            write_step(path, [WrappedLayer(name, side, 2.5e-3, pose)])
            gmsh.initialize()
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setString("Geometry.OCCTargetUnit", "M")
            gmsh.model.occ.importShapes(str(path))
            gmsh.model.occ.synchronize()
            worst = 0.0
            for _, tag in gmsh.model.getEntities(2):
                low, high = gmsh.model.getParametrizationBounds(2, tag)
                a, b = (np.linspace(x, y, 21) for x, y in zip(low, high, strict=True))
                grid = np.stack(np.meshgrid(a, b), -1).reshape(-1, 2)
                points = np.array(gmsh.model.getValue(2, tag, grid.ravel())).reshape(-1, 3)
                worst = max(worst, float(_off(side, 2.5e-3, pose.inverse().apply_all(points)).max()))
            volume = gmsh.model.occ.getMass(3, gmsh.model.getEntities(3)[0][1])
            gmsh.finalize()
        outer = PlacedFrustum(side).parallel(2.5e-3).frustum
        exact = (
            0.5 * side.wrap * side.slant * 2.5e-3 * 0.5 * (side.radius1 + side.radius2 + outer.radius1 + outer.radius2)
        )
        print(f"  {name:13} {worst:.1e}   volume {volume / exact - 1.0:+.1e}")


def _off(side: Frustum, thickness: float, points: np.ndarray) -> np.ndarray:
    """Return the distance of points from the nearest of the six faces of a layer [m]."""
    x, y, z = points.T
    radius, phi = np.hypot(x, y), np.arctan2(y, x) % (2.0 * math.pi)
    along = (radius - side.radius1) * side.sin_half_angle + z * side.cos_half_angle
    above = (radius - side.radius1) * side.cos_half_angle - z * side.sin_half_angle
    faces = [np.abs(above), np.abs(above - thickness), np.abs(along), np.abs(along - side.slant)]
    faces += [np.abs(np.sin(phi)) * radius, np.abs(np.sin(phi - side.wrap)) * radius]
    return np.asarray(np.min(faces, axis=0))


def jig(path: Path) -> Iterator[str]:
    """Yield the rows of a link: its nearest distance to each collar, or why it has none."""
    try:
        try:
            design = cs.design_link(path)
        except cs.MeshError:  # metres by its header, and 200 of them
            design = cs.design_link(path, unit="mm")
    except cs.ConeSkinError as exc:
        yield f"  {path.name}: {str(exc)[:90]}"
        return
    assert design.mesh is not None
    for index, sheet in enumerate(design.sheets):
        collars, without = jig_collars(sheet, design.mesh, design.sheets[:index])
        body = with_sheets(design.mesh, design.sheets[:index])
        for collar in collars:
            gaps = [_gap(sheet, collar, part.surface, body) for part in collar.parts]
            turns = "" if collar.play is None else f", turns {math.degrees(collar.play):.0f} deg"
            yield (
                f"  {path.name} {sheet.name} end {collar.end}: {min(gap for gap, _ in gaps):.3f}"
                f"{' TOUCHES' if any(crossed for _, crossed in gaps) else ''}, lip {1e3 * collar.lip:.1f} mm"
                f"{', flush' if collar.flush else ''}{turns}"
            )
        for sentence in without:
            yield f"  {path.name} {sheet.name}: {sentence}"


def _gap(sheet: SheetDesign, collar: Collar, surface: trimesh.Trimesh, body: Mesh) -> tuple[float, bool]:
    """Return the distance of the link from a part [mm], negative where it is in the plastic, and whether they meet.

    They meet if an edge of one crosses a face of the other, or if a point of the link is in the plastic.
    """
    plan, side = sheet.options.jig, sheet.place.frustum
    lift, sign = sheet.options.stack.thickness * side.sin_half_angle, (-1.0 if collar.end == 1 else 1.0)
    start = (min(0.0, -lift) if collar.end == 1 else side.height + max(0.0, -lift)) + sign * plan.clearance
    x, y, z = sheet.place.link_frustum.inverse().apply_all(body.vertices).T
    vertices = np.column_stack([x, sign * y, sign * (z - start) + plan.reach])
    part = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert part.is_volume
    corners = vertices[body.faces]
    near = (corners.max(axis=1) > part.bounds[0] - 3e-3) & (corners.min(axis=1) < part.bounds[1] + 3e-3)
    faces = body.faces[near.all(axis=1)]
    if len(faces) == 0:
        return math.inf, False
    link = trimesh.Trimesh(vertices, faces, process=False)
    link.remove_unreferenced_vertices()
    points = np.concatenate([link.vertices, link.sample(SAMPLE_COUNT, seed=1)])
    points = points[((points > part.bounds[0] - 3e-3) & (points < part.bounds[1] + 3e-3)).all(axis=1)]
    if len(points) == 0:
        return math.inf, False
    inside = part.contains(points)
    if inside.any():
        return -1e3 * float(_distances(part, points[inside][:NEAREST_COUNT]).max()), True
    near_first = np.argsort(KDTree(part.sample(SAMPLE_COUNT, seed=2)).query(points)[0])
    distance = _distances(part, points[near_first[:NEAREST_COUNT]])
    assert np.isfinite(distance).all()
    crossed = _crosses(link, part) or _crosses(part, link)
    return 1e3 * float(distance.min()), crossed or bool((distance == 0.0).any())


def _crosses(one: trimesh.Trimesh, other: trimesh.Trimesh) -> bool:
    """Tell whether an edge of one surface crosses a face of another."""
    ends = one.vertices[one.edges_unique]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    ends, length = ends[length > 0.0], length[length > 0.0]
    rays = RayCaster(make_mesh(other.vertices, other.faces, "a part", "m"))
    depth, _ = rays.cast(ends[:, 0], (ends[:, 1] - ends[:, 0]) / length[:, None])
    return bool((depth < length).any())


def _distances(part: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Return the distance of points from a surface [m]; slivers are no exception, unlike in trimesh.proximity.

    The nearest point of a triangle lies on an edge, or is the foot of the perpendicular where that is inside.
    """
    triangles = np.asarray(part.triangles)
    centre = triangles.mean(axis=1)
    reach = float(np.linalg.norm(triangles - centre[:, None], axis=2).max())
    bound = KDTree(part.vertices).query(points)[0]
    result = np.empty(len(points))
    for k, at in enumerate(KDTree(centre).query_ball_point(points, bound + reach + 1e-9)):
        corner, point = triangles[at], points[k]
        way = np.roll(corner, -1, axis=1) - corner
        share = np.einsum("ijk,ijk->ij", point - corner, way) / np.maximum(np.einsum("ijk,ijk->ij", way, way), 1e-30)
        foot = corner + np.clip(share, 0.0, 1.0)[..., None] * way
        best = float(np.linalg.norm(point - foot, axis=2).min())
        normal = np.cross(way[:, 0], way[:, 1])
        size = np.linalg.norm(normal, axis=1)
        side = np.einsum("ijk,ik->ij", np.cross(way, point - corner), normal)
        above = (size > 0.0) & (side >= 0.0).all(axis=1)
        if above.any():
            height = np.abs(np.einsum("ij,ij->i", point - corner[above, 0], normal[above])) / size[above]
            best = min(best, float(height.min()))
        result[k] = best
    return result
