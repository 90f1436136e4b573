"""Suspicions: values of a scene that are possible, and hardly meant: another unit, a sensor beside its link.

A mistake is refused by the reader; what is said here may be right, so that it is a warning of ``doctor --check`` and of
``doctor``. Each names the key, what it looks like, and what to write, in the unit of the file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

from coneskin.core.finding import Finding
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.model import ArmModel

from .required_packages import missing_packages
from .values.scene import LinkScene, PlacedSensor, Scene

_TURN = 2.0 * math.pi  # rad
_EIGHTH = math.pi / 4.0  # rad; angles that people write in radians are mostly multiples of it
_CLOSE = 0.003  # of a number, to such a multiple
_SMALL = 2e-3  # m; a pose in metres that was taken for millimetres is nearer than this
_BEYOND, _BESIDE, _TILT = 0.05, 0.03, math.radians(20.0)  # m, m, rad, by which a sensor may be off its tube
_OVERLAP = 1e-3  # m
_ON_TOP = 3e-3  # m; a sensor that is wider by that is meant to lie on the other one
_ROOM = 0.5  # part of the distance between the axes of two tubes, along that of the elbow, that one of them may fill
_FRAME_BITS = 360  # of a frame of 36 bytes on a serial line
_SLOW = 100.0  # Hz, docs/look-up/wire-format.md
_BUILT_IN = 921600  # baud
_SCHEMES = ("socket", "rfc2217", "loop", "hwgrep", "spy", "alt", "cp2110")  # of pyserial


def suspicions(scene: Scene) -> list[Finding]:
    """Return what is hardly meant in a scene, all of it warnings: of the item "scene", and of "packages"."""
    found = [Finding("scene", "warning", line) for line in (*_units(scene), *_placing(scene), *_line(scene))]
    missing, remedy = missing_packages(scene)
    if missing:
        value = f"{len(missing)} packages that it needs are not installed"
        found.append(Finding("packages", "warning", value, "", remedy))
    return found


# ---- units


def _units(scene: Scene) -> Iterator[str]:
    for link in scene.links:
        for item in link.sensors:
            yield from _sensor_units(f"link {link.name}, {item.sensor.name}", item)
    if scene.arm is not None and scene.arm.table_z and abs(scene.arm.table_z) < _SMALL:
        mm = 1e3 * scene.arm.table_z
        yield f"arm.table_z_mm = {mm:g} looks like metres: then write {1e3 * mm:g}"
    for number, touch in enumerate(scene.source.touches if scene.source else (), 1):
        said = math.degrees(touch.phi)
        if said <= 1.001 * _TURN and _like_radians(said):
            yield f"source.touch {number}: phi_deg = {said:g} looks like radians: then write {math.degrees(said):.4g}"
    for number, point in enumerate(scene.motion.waypoints if scene.motion else (), 1):
        angles = [math.degrees(q) for q in point]
        if (most := max(map(abs, angles))) <= 1.001 * _TURN and any(map(_like_radians, angles)):
            yield (
                f"motion.waypoints_deg[{number}] has no angle above {most:g} deg, which looks like radians: "
                "1.5708 rad are 90 deg"
            )


def _sensor_units(where: str, item: PlacedSensor) -> Iterator[str]:
    pose = item.placed.link_frustum
    angles = [math.degrees(angle) for angle in pose.rpy]
    wrong = [angle for angle in angles if _like_radians(angle)]
    if wrong and max(map(abs, angles)) <= 1.001 * _TURN:
        written = [round(math.degrees(angle), 2) + 0.0 for angle in angles]
        yield f"{where}: rpy_deg = {[round(a, 4) + 0.0 for a in angles]} looks like radians: then write {written}"
    xyz = pose.translation
    if 0.02 * _SMALL < max(map(abs, xyz)) < _SMALL:
        said, written = [round(1e3 * x, 4) + 0.0 for x in xyz], [round(1e6 * x, 1) + 0.0 for x in xyz]
        yield f"{where}: xyz_mm = {said} looks like metres: then write {written}"


def _like_radians(number: float) -> bool:
    """Tell whether a number that stands for degrees is a multiple of an eighth of a turn in radians."""
    times = number / _EIGHTH
    return abs(number) > 0.5 and round(times) != 0 and abs(times - round(times)) < _CLOSE * abs(times)


# ---- places


def _placing(scene: Scene) -> Iterator[str]:
    for link in scene.links:
        if scene.arm is not None:
            yield from _on_tube(link, scene.arm.model)
        for first, second in combinations(link.sensors, 2):
            if _overlap(first, second):
                yield (
                    f"link {link.name}: {first.sensor.name} and {second.sensor.name} lie over one another: correct "
                    "xyz_mm or height_mm of one of them"
                )


def _on_tube(link: LinkScene, model: str) -> Iterator[str]:
    """Compare the sensors of a tube with its axis and its neighbour."""
    from coneskin.robot.arm.kinematics import MESHED_ARMS, TUBE_LENGTHS, link_index, link_mesh, link_name
    from coneskin.robot.arm.models import arm_model

    name = link_name(link_index(link.name))
    if name not in TUBE_LENGTHS:
        return
    arm = arm_model(model)
    if arm.name not in MESHED_ARMS and link.frame != "mesh":
        return
    length = abs(arm.a[TUBE_LENGTHS[name]])
    room = _ROOM * abs(link_mesh(arm, "upper_arm").translation[2] - link_mesh(arm, "forearm").translation[2])
    for item in link.sensors:
        where, cone = f"link {link.name}, {item.sensor.name}", item.sensor.frustum
        in_mesh = _mesh_frame(link, arm) @ item.placed.link_frustum
        begin, end = in_mesh.translation, in_mesh.apply((0.0, 0.0, cone.height))
        low, high = min(begin[2], end[2]), max(begin[2], end[2])
        if low < -_BEYOND or high > length + _BEYOND:
            yield (
                f"{where} reaches from {1e3 * low:.0f} to {1e3 * high:.0f} mm along the {name}, whose joints are at "
                f"0 and {1e3 * length:.0f} mm: name the link and the arm that it was designed for; correct xyz_mm or "
                "the frame if they are yours"
            )
            continue
        beside = max(math.hypot(*begin[:2]), math.hypot(*end[:2]))
        along = in_mesh.rotate((0.0, 0.0, 1.0))
        from_joint = max(math.hypot(x, min(abs(z), abs(z - length))) for x, _, z in (begin, end))
        if abs(along[1]) > math.cos(_TILT) and from_joint < _BESIDE:
            continue  # it lies about the joint at an end of the tube, whose axis is y of the mesh's frame
        tilt = math.acos(min(1.0, abs(along[2])))
        if beside > _BESIDE or tilt > _TILT:
            yield (
                f"{where} lies {1e3 * beside:.0f} mm beside the axis of the {name}, turned by "
                f"{math.degrees(tilt):.0f} deg against it: name the link and the arm that it was designed for; correct "
                "xyz_mm, rpy_deg or the frame if they are yours"
            )
        radius = max(cone.radius1, cone.radius2)
        if radius > room:
            yield (
                f"{where}: a radius of {1e3 * radius:g} mm fills more than half of the {1e3 * room / _ROOM:.0f} mm "
                f"between the axes of upper arm and forearm of a {arm.name}: is it a diameter? Then write "
                f"{0.5e3 * radius:g}"
            )


def _mesh_frame(link: LinkScene, arm: ArmModel) -> Pose:
    """Return the pose of the link's frame of the scene in the frame of its mesh."""
    from coneskin.robot.arm.kinematics import dh_mesh, link_mesh

    if link.frame == "mesh":
        return Pose()
    return (dh_mesh(arm, link.name) if link.frame == "dh" else link_mesh(arm, link.name)).inverse()


def _overlap(first: PlacedSensor, second: PlacedSensor) -> bool:
    """Tell whether two sensors of one link cover the same place of it."""
    one, other = first.placed, second.placed
    relative = one.link_frustum.inverse() @ other.link_frustum
    begin, end = relative.translation, relative.apply((0.0, 0.0, other.frustum.height))
    if other.frustum.wrap < 0.5 * _TURN and other.frustum.radius1 - one.frustum.radius1 > _ON_TOP:
        return False  # a strip over the seam of the other
    if max(math.hypot(*begin[:2]), math.hypot(*end[:2])) > min(one.frustum.radius1, one.frustum.radius2):
        return False  # they lie about different axes
    low, high = min(begin[2], end[2]), max(begin[2], end[2])
    if min(high, one.frustum.height) - max(low, 0.0) < _OVERLAP:
        return False
    x, y, _ = relative.rotate((math.cos(0.5 * other.frustum.wrap), math.sin(0.5 * other.frustum.wrap), 0.0))
    between = abs(math.remainder(math.atan2(y, x) - 0.5 * one.frustum.wrap, _TURN))
    return between < 0.5 * (one.frustum.wrap + other.frustum.wrap) - 1e-3


# ---- the line


def _line(scene: Scene) -> Iterator[str]:
    if scene.source is None:
        return
    members = scene.source.settings.get("members", ((scene.source.kind, scene.source.settings),))
    for kind, settings in members:
        if kind != "serial":
            continue
        port, baud = str(settings["port"]), settings["baud"]
        scheme, colon, _ = port.partition("://")
        if colon and scheme not in _SCHEMES:
            yield f"source.port: {scheme}:// is no scheme of pyserial; it has {', '.join(f'{s}://' for s in _SCHEMES)}"
        count = max(1, len(scene.sensors) // len(members))
        rate = baud / _FRAME_BITS / count
        if rate < _SLOW and not colon:
            yield (
                f"source.baud = {baud} carries at most {rate:.0f} frames/s of each of {count} sensors, and below "
                f"{_SLOW:g} the guard misses them: set it and the firmware to {_BUILT_IN}"
            )
