"""Interference of all that is on a link: sheets, tabs, cables, ties, connectors, and the link itself.

    python -m bench design-assembly FOLDER            # every STL, DAE and OBJ in it, three sheets at most
    python -m bench design-assembly --sheets 4 LINK ...
    python -m bench design-assembly --robot arm.urdf SKIN   # a folder of coneskin design arm.urdf --wires N

Each link is designed and written; what is checked is read from its design.json alone. Of a robot, the bodies on each
link and the cables to the boards are held against the links beside it as well, every 5 degrees of the joint between.
Solids are made of the numbers by trimesh and cut with each other by Manifold; against the link, whose mesh is seldom
closed, embree's rays decide, most of fourteen for each corner. Nothing of the placer is used. Two bodies interfere if
they share more than 1 mm3, and a body and the link if a corner lies more than 1 mm inside. A side that is not round is
laid out by ``Developable``.

"covered" is the area of the sheets, "active" that in which a touch is located, both over the hull. The first bounds the
second for these sheets. The time includes the search and the files.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import coneskin as cs
from bench.report import head
from coneskin.commands.terminal import add_urdf_options, urdf_options
from coneskin.core.errors import ConeSkinError
from coneskin.design.link_design import load_link
from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import UrdfJoint, urdf_joints, urdf_links

SUFFIXES = (".stl", ".dae", ".obj")
LEAST_VOLUME = 1.0  # mm3
LEAST_DEPTH = 1.0  # mm
SWEEP_STEP, FOLD_STEP = np.radians([5.0, 30.0])  # of the joint to the next link, of the two to the one after it
CABLE_RADIUS, TIE, CONNECTOR = 1.9, (12.0, 12.0, 5.0), (11.0, 13.0, 6.0)  # mm; boxes across, along, high
Place = Callable[[Any, Any, Any], np.ndarray]
Bodies = list[tuple[str, Any]]  #: solids by their names


def side_of(sheet: dict[str, Any]) -> Place:
    """Return the point [mm] at u [mm], phi [rad] and a height [mm], by the cone's own numbers."""
    cone = sheet["link_cone"]
    turn = np.radians(cone["rpy_deg"])
    if "bends" in sheet:
        bends = tuple(Bend(*np.radians([b["width_deg"], b["turn_deg"]]).tolist()) for b in sheet["bends"])
        wrap = sum(bend.width for bend in bends)
        shape = Frustum(*(1e-3 * cone[k] for k in ("radius1_mm", "radius2_mm", "height_mm")), min(wrap, 2 * np.pi))
        bends = (*bends[:-1], Bend(shape.wrap - sum(b.width for b in bends[:-1]), bends[-1].turn))
        pose = Pose.from_xyz_rpy(tuple(1e-3 * np.array(cone["xyz_mm"])), tuple(turn))
        bent = Developable(shape, pose, bends, 1e-3 * sheet["bend_lift_mm"])

        def ruled(u: Any, phi: Any, height: Any) -> np.ndarray:
            points, normals = bent.place(1e-3 * np.asarray(u), phi)
            return np.asarray(1e3 * points + np.asarray(height)[..., None] * normals)

        return ruled
    matrix = trimesh.transformations.euler_matrix(*turn, "sxyz")[:3, :3]
    slope = np.arctan2(cone["radius2_mm"] - cone["radius1_mm"], cone["height_mm"])

    def cone_point(u: Any, phi: Any, height: Any) -> np.ndarray:
        u, phi, height = np.broadcast_arrays(*(np.asarray(x, float) for x in (u, phi, height)))
        radius = cone["radius1_mm"] + u * np.sin(slope) + height * np.cos(slope)
        z = u * np.cos(slope) - height * np.sin(slope)
        return np.asarray(
            np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1) @ matrix.T + np.array(cone["xyz_mm"])
        )

    return cone_point


def shell(place: Place, u: tuple[float, float], phi: tuple[float, float], heights: tuple[float, float]) -> Any:
    """Return a closed solid between two heights above a part of a side; hexahedra side by side, so never twisted."""
    count = max(2, int(np.ceil((phi[1] - phi[0]) / np.radians(2.0))) + 1)
    rows = max(2, int((u[1] - u[0]) / 40.0) + 2)
    at = np.linspace(*phi, count)
    corners = np.stack([place(np.linspace(*u, rows)[:, None], at[None], np.full((1, 1), h)) for h in heights])
    index = np.arange(2 * rows * count).reshape(2, rows, count)
    faces: list[np.ndarray] = []

    def quads(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> None:
        faces.extend([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])

    for layer, flip in ((1, 1), (0, -1)):
        grid = index[layer]
        quads(*(grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1])[::flip])
    for line, flip in (
        (index[:, 0, :], 1),
        (index[:, -1, :], -1),
        (index[:, :, 0], -1),
        (index[:, :, -1], 1),
    ):
        quads(*(line[0, :-1], line[0, 1:], line[1, 1:], line[1, :-1])[::flip])
    solid = trimesh.Trimesh(corners.reshape(-1, 3), np.concatenate(faces), process=False)
    if solid.volume < 0:
        solid.invert()
    return solid


def box_at(point: np.ndarray, normal: np.ndarray, along: np.ndarray, size: tuple[float, float, float]) -> Any:
    """Return a box that stands on the link at a point, with its length along a way."""
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([np.cross(along, normal), along, normal], 1)
    frame[:3, 3] = point + (0.5 * size[2] + 0.2) * normal
    return trimesh.creation.box(size, frame)


def _risen(place: Place, slope: float, away: Callable[..., np.ndarray]) -> Place:
    """Return a side on which heights grow with the distance from the rim."""
    return lambda u, phi, height: place(u, phi, height + slope * away(u, phi))


def bodies_of(sheet: dict[str, Any], thickness: float) -> Iterator[tuple[str, Any]]:
    """Yield the solids of one sheet: the sheet, its tabs, its cable in pieces, its tie and its connector."""
    place, cone = side_of(sheet), sheet["link_cone"]
    wrap = np.radians(cone["wrap_deg"])
    inside = 0.5e-3  # rad; so that a full wrap is no ring that meets itself
    yield "sheet", shell(place, (0.0, cone["slant_mm"]), (inside, wrap - inside), (0.1, thickness))
    radius = {"end1": cone["radius1_mm"], "end2": cone["radius2_mm"]}
    tab_height = 0.5 * thickness
    rise = sheet["cable"]["tab_rise_deg"]
    slope = np.inf if rise == 90.0 else np.tan(np.radians(rise))
    for corners in sheet["electrodes"].values():
        for corner in corners:
            if "tab_width_mm" not in corner:
                continue
            u, phi, side = corner["u_mm"], np.radians(corner["phi_deg"]), corner["side"]
            half, long = 0.5 * corner["tab_width_mm"], corner["tab_length_mm"]
            if side in radius:
                away = -1.0 if side == "end1" else 1.0
                ends = sorted((u + 0.2 * away, u + long * away))
                rising = _risen(place, slope, lambda u_at, _, rim=u: np.abs(u_at - rim))
                span = phi - half / radius[side], phi + half / radius[side]
            elif not np.isfinite(slope):  # it stands up from the seam
                thin = 0.25 / (cone["radius1_mm"] + (cone["radius2_mm"] - cone["radius1_mm"]) * u / cone["slant_mm"])
                yield (
                    "tab",
                    shell(place, (u - half, u + half), (phi - thin, phi + thin), (tab_height, tab_height + long)),
                )
                continue
            else:
                share = u / cone["slant_mm"]
                around = (1.0 - share) * cone["radius1_mm"] + share * cone["radius2_mm"]
                away = -1.0 if side == "edge0" else 1.0
                ends = [u - half, u + half]
                rising = _risen(place, slope, lambda _, p_at, rim=phi, r=around: np.abs(p_at - rim) * r)
                span = tuple(sorted((phi + 0.2 * away / around, phi + long * away / around)))  # type: ignore[assignment]
            yield "tab", shell(rising, (ends[0], ends[1]), span, (tab_height, tab_height + 0.5))
    way = sheet["cable"]["way"]
    points, normals = (np.array([step[key] for step in way]) for key in ("xyz_mm", "normal"))
    lifted = points + (CABLE_RADIUS + 0.2) * normals
    for one, two in itertools.pairwise(lifted):
        yield "cable", trimesh.creation.cylinder(CABLE_RADIUS, segment=[one, two], sections=12)
    for name, index, size in (("tie", sheet["cable"]["tie_at"], TIE), ("connector", len(way) - 1, CONNECTOR)):
        yield name, box_at(points[index], normals[index], points[index] - points[index - 1], size)


def shared_volume(one: Any, two: Any) -> float:
    """Return the volume that two solids share [mm3]."""
    if (one.bounds[0] > two.bounds[1]).any() or (two.bounds[0] > one.bounds[1]).any():
        return 0.0
    return abs(float(trimesh.boolean.intersection([one, two], engine="manifold", check_volume=False).volume))


def depth_in_link(points: np.ndarray, link: Any) -> float:
    """Return how deep the deepest of some points lies in a link [mm]; 0 for points outside."""
    if not len(points):
        return 0.0
    ways = np.array([w for w in itertools.product((-1, 0, 1), repeat=3) if sum(map(abs, w)) in (1, 3)], float)
    ways = ways @ trimesh.transformations.euler_matrix(0.3, 0.5, 0.7)[:3, :3].T
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    starts, along = np.repeat(points, len(ways), axis=0), np.tile(ways, (len(points), 1))
    hits, rays, _ = link.ray.intersects_location(starts, along, multiple_hits=True)
    counts = np.bincount(rays, minlength=len(starts)).reshape(len(points), -1)
    inside = (counts % 2).mean(axis=1) > 0.7
    near = np.full(len(starts), np.inf)
    np.minimum.at(near, rays, np.linalg.norm(hits - starts[rays], axis=1))
    depth = np.where(inside, near.reshape(len(points), -1).min(axis=1), 0.0)
    return float(depth.max(initial=0.0))


def interferences(data: dict[str, Any], link: Any) -> list[str]:
    """Return what interferes in a design, in words.

    Args:
        data: content of design.json.
        link: mesh of the link [mm].
    """
    bodies = [
        (number, name, solid)
        for number, sheet in enumerate(data["sheets"], 1)
        for name, solid in bodies_of(sheet, sheet["thickness_mm"])
    ]
    found: dict[str, float] = {}
    for (i, one, a), (j, two, b) in itertools.combinations(bodies, 2):
        if i == j and "sheet" not in (one, two):
            continue  # tabs, cable, tie and connector of one sheet are one strand
        if i == j and "tab" in (one, two):
            continue
        volume = shared_volume(a, b)
        if volume > LEAST_VOLUME:
            key = f"{one} {i} in {two} {j}"
            found[key] = found.get(key, 0.0) + volume
    for number, name, solid in bodies:
        if name != "sheet" and data["sheets"][number - 1]["cable"].get("on_link", True):
            depth = depth_in_link(np.vstack([solid.vertices, solid.centroid]), link)
            if depth > LEAST_DEPTH:
                found[f"{name} {number} in the link"] = depth
    return [f"{what} ({size:.1f} {'mm' if 'link' in what else 'mm3'})" for what, size in found.items()]


def ways_from(link: str, joints: Sequence[UrdfJoint], steps: int) -> Iterator[tuple[str, list[tuple[UrdfJoint, bool]]]]:
    """Yield each link that is at most so many joints away, with the joints between and whether each leads outwards."""
    ways: list[tuple[str, list[tuple[UrdfJoint, bool]]]] = [(link, [])]
    for at, way in ways:
        for joint in joints if len(way) < steps else ():
            if at not in (joint.parent, joint.child) or any(joint is passed for passed, _ in way):
                continue
            outwards = joint.parent == at
            ways.append((joint.child if outwards else joint.parent, [*way, (joint, outwards)]))
            yield ways[-1]


def poses_along(way: list[tuple[UrdfJoint, bool]]) -> Iterator[np.ndarray]:
    """Yield the pose of the link at the end of a way [mm], over the ranges of the joints on it."""
    step = SWEEP_STEP if len(way) < 2 else FOLD_STEP
    for angles in itertools.product(
        *(np.linspace(j.lower, j.upper, int((j.upper - j.lower) / step) + 2) for j, _ in way)
    ):
        pose = np.eye(4)
        for (joint, outwards), angle in zip(way, angles, strict=True):
            place = np.eye(4)
            place[:3, :3], place[:3, 3] = joint.origin.rotation, 1e3 * np.array(joint.origin.translation)
            place = place @ trimesh.transformations.rotation_matrix(angle, joint.axis)
            pose = pose @ (place if outwards else np.linalg.inv(place))
        yield pose


def cloud(solid: Any) -> np.ndarray:
    """Return the corners of a solid and places on its surface [mm]."""
    return np.vstack([solid.vertices, trimesh.sample.sample_surface(solid, 500, seed=1)[0]])


def swept(link: str, skins: dict[str, Bodies], joints: Sequence[UrdfJoint], meshes: dict[str, Any]) -> list[str]:
    """Return which bodies of a link meet the next links or their skins over the range of the joint between.

    Two joints away an arm folds onto itself, bare or not: there it is said in how many poses each does.

    Args:
        link: its name.
        skins: the bodies on each link, by their names.
        joints: of the robot.
        meshes: of its links [mm].
    """
    worst: dict[str, float] = {}
    folds = []
    bodies = [(name, cloud(solid)) for name, solid in skins[link]]
    points = np.concatenate([corners for _, corners in bodies])
    owner = np.repeat(np.arange(len(bodies)), [len(corners) for _, corners in bodies])
    bare = trimesh.sample.sample_surface(meshes[link], 2000, seed=1)[0]
    for other, way in ways_from(link, joints, 2):
        if other not in meshes:
            continue
        solids = {other: meshes[other]}
        if len(way) == 1:
            solids |= {f"{name} of {other}": solid for name, solid in skins.get(other, ())}
        met = Counter[str]()
        for pose in poses_along(way):
            back = np.linalg.inv(pose)
            moved = trimesh.transform_points(points, back)
            if len(way) > 1:
                there = depth_in_link(inside(trimesh.transform_points(bare, back), solids[other]), solids[other])
                skin = depth_in_link(inside(moved, solids[other]), solids[other])
                met["bare" if there > LEAST_DEPTH else "skin" if skin > LEAST_DEPTH else "none"] += 1
                continue
            for what, solid in solids.items():
                near = np.flatnonzero(((moved > solid.bounds[0]) & (moved < solid.bounds[1])).all(axis=1))
                for number in np.unique(owner[near]):
                    depth = depth_in_link(moved[near[owner[near] == number]], solid)
                    key = f"{bodies[number][0]} in {what}"
                    worst[key] = max(worst.get(key, 0.0), depth)
        if met["skin"]:
            folds.append(f"folded onto {other} in {met['skin']} of {met.total()} poses (bare {met['bare']})")
    return [f"{what} ({depth:.1f} mm)" for what, depth in worst.items() if depth > LEAST_DEPTH] or ["none", *folds]


def inside(points: np.ndarray, solid: Any) -> np.ndarray:
    """Return the points within the bounds of a solid."""
    return points[((points > solid.bounds[0]) & (points < solid.bounds[1])).all(axis=1)]


def bundles_on(link: str, cables: list[dict[str, Any]]) -> Iterator[tuple[int, Any]]:
    """Yield the straight pieces on a link of the cables to the boards, with their sensors.

    They are as thick as all cables together, but for the first one from a connector, which is a cable by itself.
    """
    ways = [
        (c["sensor"], k, s["points_mm"]) for c in cables for k, s in enumerate(c["sections"]) if s.get("link") == link
    ]
    for sensor, section, points in ways:
        for number, ends in enumerate(itertools.pairwise(points)):
            radius = CABLE_RADIUS * (1.0 if section == number == 0 else len(ways) ** 0.5)
            yield sensor, trimesh.creation.cylinder(radius, segment=ends, sections=12)


def laid_over(bundles: Sequence[tuple[int, Any]], data: dict[str, Any], link: Any, first: int) -> list[str]:
    """Return what cables to the boards meet on a link, and over which active areas they lie, in words.

    Args:
        bundles: their pieces, from the connector on, with their sensors.
        data: content of the design.json of the link.
        link: its mesh [mm].
        first: sensor of its first sheet.
    """
    found: dict[str, float] = {}
    begun: set[int] = set()
    for sensor, piece in bundles:
        for number, sheet in enumerate(data["sheets"], first):
            thickness, patch = sheet["thickness_mm"], sheet["active_patch"]
            span = (patch["u1_mm"], patch["u2_mm"]), tuple(np.radians([patch["phi1_deg"], patch["phi2_deg"]]))
            above = "the active area", shell(side_of(sheet), span[0], span[1], (thickness, thickness + 4.0))
            leaves = sensor == number and sensor not in begun  # from its own connector
            for what, solid in [above, *(bodies_of(sheet, thickness) if not leaves else ())]:
                if (volume := shared_volume(piece, solid)) > LEAST_VOLUME:
                    key = f"bundle {sensor} in {what} {number}"
                    found[key] = found.get(key, 0.0) + volume
        if (depth := depth_in_link(np.vstack([piece.vertices, piece.centroid]), link)) > LEAST_DEPTH:
            found[f"bundle {sensor} in the link"] = depth
        begun.add(sensor)
    return [f"{what} ({size:.1f} {'mm' if 'link' in what else 'mm3'})" for what, size in found.items()]


def check_robot(robot: Path, skin: Path, **urdf: Any) -> None:
    """Print what interferes on each link of a robot, and with the links beside it and their skins."""
    meshes = {}
    for name in urdf_links(robot, **urdf):
        mesh = next(load_link(f"{robot}#{name}", **urdf)).mesh
        meshes[name] = trimesh.Trimesh(1e3 * mesh.vertices, mesh.faces, process=False)
    joints = urdf_joints(robot, **urdf)
    designs = {file.parent.name: json.loads(file.read_text()) for file in sorted(skin.glob("*/design.json"))}
    skins: dict[str, Bodies] = {
        name: [
            (f"{what} {number}", solid)
            for number, sheet in enumerate(data["sheets"], 1)
            for what, solid in bodies_of(sheet, sheet["thickness_mm"])
        ]
        for name, data in designs.items()
    }
    tree = json.loads((skin / "design.json").read_text())
    first = 0
    for name, mesh in meshes.items():
        data = designs.get(name, {"sheets": ()})
        bundles = list(bundles_on(name, tree["cables"]["cables"]))
        if not bundles and name not in designs:
            continue
        own = [*skins.get(name, ()), *((f"bundle {number}", piece) for number, piece in bundles)]
        found = interferences(data, mesh) + laid_over(bundles, data, mesh, first)
        found += swept(name, skins | {name: own}, joints, meshes)
        first += len(data["sheets"])
        print(f"{name:30s}{len(data['sheets']):7d} sheets  {'; '.join(found)}", flush=True)


def main() -> None:
    """Design every link, check it, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("links", nargs="+", type=Path, metavar="LINK", help="meshes, or folders of them")
    parser.add_argument("--sheets", type=int, default=3, help="sheets at most (default 3)")
    parser.add_argument("--robot", type=Path, metavar="URDF", help="of the robot whose skins are in the folders")
    add_urdf_options(parser.add_argument)
    arguments = parser.parse_args()
    if arguments.robot is not None:
        print(head("trimesh", "manifold3d", "embreex"))
        for skin in arguments.links:
            check_robot(arguments.robot, skin, **urdf_options(arguments))
        return
    files = [
        file
        for path in arguments.links
        for file in (sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES) if path.is_dir() else [path])
    ]
    print(head("trimesh", "manifold3d", "embreex"))
    print(f"{'link':30s}{'faces':>8s}{'cpu s':>7s}{'sheets':>7s}{'covered':>8s}{'active':>8s}  interference")
    actives, spent, dirty, several, wires = [], [], 0, 0, 0
    for path in files:
        since = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            try:
                design = cs.design_link(
                    path, f"{folder}/out", pictures=False, max_sheets=arguments.sheets, allow_hull=True
                )
            except ConeSkinError as error:
                spent.append(time.process_time() - since)
                print(f"{path.name:30s}{spent[-1]:15.1f}  refused: {str(error)[:90]}", flush=True)
                continue
            cpu = time.process_time() - since
        assert design.mesh is not None
        assert design.fit is not None
        link = trimesh.Trimesh(1e3 * design.mesh.vertices, design.mesh.faces, process=False)
        found = interferences(dict(design.data), link)
        hull = 1e4 * design.fit.hull_area
        covered = sum(sheet["fit"]["area_share"] for sheet in design.data["sheets"])
        active = sum(sheet["active_area_cm2"] for sheet in design.data["sheets"]) / hull
        actives.append(active)
        spent.append(cpu)
        count = len(design.sheets)
        wires += 4 * count
        several += count > 1
        dirty += bool(found)
        print(
            f"{path.name:30s}{len(design.mesh.faces):8d}{cpu:7.1f}{count:7d}{covered:8.3f}{active:8.3f}  "
            f"{'; '.join(found) or 'none'}",
            flush=True,
        )
    if actives:
        print(
            f"{len(actives)} links, {several} with several sheets, {wires} wires; interference on {dirty}; active share"
            f" {statistics.median(actives):.3f} (median); processor time {statistics.median(spent):.1f} s (median), "
            f"{max(spent):.1f} s (most)"
        )


if __name__ == "__main__":
    main()
