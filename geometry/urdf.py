"""Joints of a URDF, and the mesh of one of its links in the frame of the link.

A xacro file is expanded to the URDF that it describes. It is a program: it names further files, and its expressions are
evaluated. Expand only what you trust.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlparse
from xml.etree import ElementTree

import numpy as np

from coneskin.core.errors import MeshError, needed_package
from coneskin.core.files import read_file

from .mesh import Mesh, _refuse_entities, load_mesh, make_mesh
from .pose import Pose, Vector


def _expand_xacro(
    path: str | Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, str | Path] | None = None,
) -> bytes:
    """Return the URDF that a xacro file describes, in UTF-8; paths of meshes beside it become absolute."""
    path = Path(path)
    with needed_package("xacrodoc", f"expanding {path.name}", "xacro"):
        from xacrodoc import XacroDoc
        from xacrodoc import packages as finder
    try:
        # what was found for another file must not be taken for this one
        finder.reset()
        finder.update_package_cache(dict(packages or {}))
        document = XacroDoc.from_file(path, subargs=dict(arguments or {}), resolve_packages=False)
        return str(document.to_urdf_string(pretty=False)).encode()
    except OSError as exc:
        raise MeshError(f"{path}: {exc.strerror or exc}") from exc
    except Exception as exc:  # xacro raises errors of many types, from its own to those of the expressions
        reason = " ".join(str(exc).split()) or type(exc).__name__
        advice = "name its folder (--package NAME=DIR, packages={...})" if "ackage not found" in reason else ""
        if "ndefined substitution argument" in reason:
            advice = "name its value (--xacro-arg NAME=VALUE, arguments={...})"
        raise MeshError(f"{path}: xacro cannot expand it: {reason}{': ' if advice else ''}{advice}") from exc


MAX_SIZE = 10_000_000  # bytes of a URDF


def urdf_links(
    path: str | Path,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> tuple[str, ...]:
    """Return the names of the links of a URDF that have a mesh, visual or collision.

    Args:
        path: a URDF, or a xacro file.
        packages: folders of the ROS packages that a xacro file names.

    Raises:
        MeshError: no such file, not a URDF, or the name of a link is taken or no name of a folder.
        MissingExtra: xacrodoc is not installed, and the file is a xacro file.
    """
    robot = _robot(Path(path), packages, arguments)
    names = tuple(link.get("name", "") for link in robot.iter("link") if link.find(".//mesh") is not None)
    for name in names:
        if not name.strip(".") or Path(name).name != name or names.count(name) > 1:  # each becomes a folder
            raise MeshError(f"{path}: the name of a link must be its own, and hold no / or .., got {name!r}")
    return names


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """A joint: x_parent = origin R(axis, angle) x_child, from lower to upper angle [rad]; one that slides is fixed."""

    name: str
    parent: str
    child: str
    origin: Pose
    axis: Vector
    lower: float
    upper: float
    limits: tuple[float, float]  #: as the file gives them [rad], over a turn as well; infinite if there are none
    travel: float  #: of one that slides [m]


def urdf_joints(
    path: str | Path,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> tuple[UrdfJoint, ...]:
    """Return the joints of a URDF, one that slides where it is nearest to 0; arguments of ``urdf_links``.

    Raises:
        MeshError: as ``urdf_links``; limits exchanged, a link that is not there, or joints that are no tree.
    """
    joints = []
    robot = _robot(Path(path), packages, arguments)
    for joint in robot.iter("joint"):
        kind, parent, child = joint.get("type", ""), joint.find("parent"), joint.find("child")
        if parent is None or child is None:
            continue
        title = joint.get("name", "")
        name = f"{path}: joint {title}"
        if kind not in ("revolute", "continuous", "fixed", "prismatic"):
            raise MeshError(f"{name}: a joint is revolute, continuous, prismatic or fixed, got {kind!r}; make it fixed")
        axis, limit = joint.find("axis"), joint.find("limit")
        way = _numbers("1 0 0" if axis is None or kind == "fixed" else axis.get("xyz", "1 0 0"), f"{name}: axis")
        if not any(way):
            raise MeshError(f"{name}: the axis of a {kind} joint must not be 0 0 0")
        lower, upper = {"continuous": (-math.pi, math.pi)}.get(kind, (0.0, 0.0))
        if kind in ("revolute", "prismatic"):
            if limit is None:
                raise MeshError(f"{name}: a {kind} joint needs a limit with lower and upper")
            lower, upper, _ = _numbers(f"{limit.get('lower', 0)} {limit.get('upper', 0)} 0", f"{name}: limit")
            if not lower <= upper:
                raise MeshError(f"{name}: the lower limit must not be above the upper, got {lower:g} and {upper:g}")
        limits, travel = (-math.inf, math.inf) if kind == "continuous" else (lower, upper), 0.0
        length = math.hypot(*way)
        unit = way[0] / length, way[1] / length, way[2] / length
        origin = _origin(joint, f"joint {title}", path)
        if kind == "prismatic":
            slid = min(max(0.0, lower), upper)
            origin, lower, upper = origin @ Pose(translation=(slid * unit[0], slid * unit[1], slid * unit[2])), 0.0, 0.0
            limits, travel = (0.0, 0.0), limits[1] - limits[0]
        elif upper - lower > math.tau:
            lower, upper = -math.pi, math.pi
        ends = parent.get("link", ""), child.get("link", "")
        joints.append(UrdfJoint(title, *ends, origin, unit, lower, upper, limits, travel))
    children, reached = [joint.child for joint in joints], link_poses(joints, [0.0] * len(joints))
    if stray := {end for joint in joints for end in (joint.parent, joint.child)} - {
        x.get("name") for x in robot.iter("link")
    }:
        raise MeshError(f"{path}: a joint holds {min(stray)!r}, and no link of the file has that name")
    if twice := [child for child in children if children.count(child) > 1 or child not in reached]:
        raise MeshError(
            f"{path}: joints form a tree, so none may close a ring or lead to a link again; {twice[0]!r} does"
        )
    return tuple(joints)


def joints_inwards(link: str, joints: Sequence[UrdfJoint], kept: Container[str]) -> tuple[str, tuple[UrdfJoint, ...]]:
    """Return the next link towards the base that is among some, and the joints between, the outermost first.

    The name is empty, and there are no joints, where no link follows.
    """
    inwards, between = {joint.child: joint for joint in joints}, list[UrdfJoint]()
    while link in inwards:
        between.append(inwards[link])
        link = between[-1].parent
        if link in kept:
            return link, tuple(between)
    return "", ()


def link_poses(joints: Sequence[UrdfJoint], angles: Sequence[float]) -> dict[str, Pose]:
    """Return the pose of each link in the frame of the root of a robot whose joints are at some angles [rad]."""
    children = {joint.child for joint in joints}
    poses = {joint.parent: Pose() for joint in joints if joint.parent not in children}
    left = list(zip(joints, angles, strict=True))
    while reached := [pair for pair in left if pair[0].parent in poses]:
        for joint, angle in reached:
            turn = Pose.from_rotation_vector([angle * x for x in joint.axis])
            poses[joint.child] = poses[joint.parent] @ joint.origin @ turn
        left = [pair for pair in left if pair[0].child not in poses]
    return poses


def joint_frame(joint: UrdfJoint, poses: Mapping[str, Pose]) -> Pose:
    """Return the frame in which a joint turns about z from its angle 0, as its parent stands in some poses of links."""
    return poses[joint.parent] @ joint.origin @ Pose.along(joint.axis)


def load_urdf_link(
    path: str | Path,
    link: str,
    geometry: str = "visual",
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
) -> Mesh:
    """Read the meshes of a link, scaled and placed as the URDF says, as one mesh.

    Args:
        path: the URDF, or a xacro file, which is expanded.
        geometry: "visual" or "collision". Collision bodies are often convex hulls that have lost the tube.
        packages: folders of the ROS packages in package:// paths; others are searched for at and beside the folders
            above the URDF.

    Returns:
        the mesh in the frame of the link [m].

    Raises:
        MeshError: no such file, link, package or mesh, or a mesh that cannot be read.
        MissingExtra: xacrodoc is not installed, and the file is a xacro file.
    """
    path = Path(path)
    if geometry not in ("visual", "collision"):
        raise MeshError(f"geometry must be 'visual' or 'collision', got {geometry!r}")
    robot = _robot(path, packages, arguments)
    found = next((item for item in robot.iter("link") if item.get("name") == link), None)
    if found is None:
        names = ", ".join(urdf_links(path, packages, arguments)) or "none with a mesh"
        raise MeshError(f"{path}: no link {link!r}; there are: {names}")
    parts: list[Mesh] = []
    shapes: list[str] = []
    for body in found.findall(geometry):
        shape = body.find("geometry/*")
        if shape is None or shape.tag != "mesh":
            shapes += [] if shape is None else [shape.tag]
            continue
        file = _resolve(shape.get("filename", ""), path, packages or {})
        scale = _numbers(shape.get("scale", "1 1 1"), f"{path}: scale of {link}")
        # lengths of a URDF are in metres; only COLLADA has a unit tag of its own
        unit = None if file.suffix.lower() == ".dae" else "m"
        parts.append(load_mesh(file, unit, scale).moved(_origin(body, link, path)))
    source = f"{path}: {link}"
    if not parts:
        other = "collision" if geometry == "visual" else "visual"
        has = f"only {', '.join(shapes)}" if shapes else "nothing"
        hint = f"; its {other} has a mesh" if found.find(f"{other}//mesh") is not None else ""
        raise MeshError(f"{source} has no {geometry} mesh, {has}{hint}")
    if len(parts) == 1:
        return Mesh(parts[0].vertices, parts[0].faces, source, parts[0].unit, parts[0].notes)
    counts = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = np.concatenate([part.faces + int(count) for part, count in zip(parts, counts, strict=False)])
    notes = list(dict.fromkeys(note for part in parts for note in part.notes))
    return make_mesh(np.concatenate([part.vertices for part in parts]), faces, source, parts[0].unit, notes)


def _robot(
    path: Path, packages: Mapping[str, str | Path] | None, arguments: Mapping[str, str] | None
) -> ElementTree.Element:
    """Return the root of a URDF; a xacro file is expanded first."""
    try:
        data = read_file(path, MAX_SIZE)
        _refuse_entities(data, path)
        root = ElementTree.fromstring(data)
        if root.tag == "robot" and any("xacro" in str(item.tag) for item in root.iter()):
            root = ElementTree.fromstring(_expand_xacro(path, arguments, packages))
    except MeshError:  # a ValueError as well
        raise
    except OSError as error:
        raise MeshError(f"{path}: {error.strerror or error}") from error
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # malformed, or of an unknown encoding
        raise MeshError(f"{path}: malformed XML: {error}") from error
    if root.tag != "robot":
        raise MeshError(f"{path}: a URDF begins with <robot>, this file with <{root.tag}>")
    return root


def _resolve(name: str, urdf: Path, packages: Mapping[str, str | Path]) -> Path:
    """Return the path of a mesh file; the name may be package://, file:// or a path beside the URDF."""
    parsed = urlparse(name)
    if parsed.scheme == "file":
        return Path(unquote(parsed.path))
    if parsed.scheme in ("package", "model"):
        package, inner = parsed.netloc, unquote(parsed.path).lstrip("/")
        if package in packages:
            return Path(packages[package]) / inner
        for folder in urdf.resolve().parents:
            for root in (folder, folder / package):
                if root.name == package and (root / inner).is_file():
                    return root / inner
        raise MeshError(
            f"{name}: package {package} is neither above nor beside {urdf}; say where it is (--package {package}=DIR, "
            "packages={...}), or name the mesh file"
        )
    if parsed.scheme and len(parsed.scheme) > 1:
        raise MeshError(f"{name}: a mesh is named by package://, file:// or a path, got {parsed.scheme}://")
    return (urdf.parent / name).resolve()


def _origin(owner: ElementTree.Element, name: str, path: str | Path) -> Pose:
    """Return the pose that the origin tag of a joint or a body gives."""
    origin = owner.find("origin")
    values = {} if origin is None else origin.attrib
    return Pose.from_xyz_rpy(
        *(_numbers(values.get(key, "0 0 0"), f"{path}: {key} of {name}") for key in ("xyz", "rpy"))
    )


def _numbers(text: str, name: str) -> Vector:
    try:
        x, y, z = (float(word) for word in text.split())
    except ValueError:
        raise MeshError(f"{name} must be 3 numbers, got {text!r}") from None
    return x, y, z
