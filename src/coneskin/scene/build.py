"""Builder of a guard's parts from a scene. Only what the scene names is imported and built.

The surfaces below sensors on meshes are recorded, as names and grids of heights, so that a replay needs no mesh file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import KinematicsError, RecordingError, SceneError
from coneskin.core.text import read_json

if TYPE_CHECKING:
    from pathlib import Path

    from coneskin.core.arrays import Floats
    from coneskin.core.recording.block import Block
    from coneskin.geometry.displacement_map import DisplacementMap
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.geometry.pose import Pose, Vector
    from coneskin.robot.arm.model import ArmModel
    from coneskin.robot.guard.arm_supervisor import ArmSupervisor
    from coneskin.robot.guard.core import GuardCore
    from coneskin.robot.guard.speed.speed_limit import SpeedLimit
    from coneskin.skin.detection.stream import TouchStream
    from coneskin.skin.sensor import Sensor

    from .values.scene import Scene, SpeedLimitScene

_MAX_DEPTH = 0.012  # m that a mesh may lie below the sensor on it: five layers, and the deviation of the fit


def build_core(
    scene: Scene, placed: Sequence[SensorOnArm] | None = None, detector: Mapping[str, Any] | None = None
) -> GuardCore:
    """Build the guard's core for a scene; the same for the live guard and for a replay.

    Args:
        placed: its sensors, as of ``place_on_arm``; None to place them.
        detector: other values than the default ones for fields of ``DetectorSettings``; in a what-if only.

    Raises:
        SceneError: the scene has no sensor to guard with.
    """
    if not scene.sensors:
        raise SceneError(["a guard needs a [[link]] with a [[link.sensor]]"], scene.name)
    from coneskin.robot.guard.core import GuardCore
    from coneskin.robot.guard.signals.contact import GuardedSensor

    limits, stream = scene.monitoring_limits, build_stream(scene, detector)
    placed = place_on_arm(scene) if placed is None else placed
    sensors = []
    for at, sensor in zip(placed, (item.sensor for item in scene.sensors), strict=True):
        levels, force = sensor.thresholds, sensor.force_table.force if sensor.force_table else None
        place = at.name, at.link_name, at.link, at.place
        sensors.append(GuardedSensor(*place, levels.touch_level, levels.location_level, force=force))
    return GuardCore(stream, sensors, limits, _arm(scene, placed) if scene.arm else None, withheld_motion(scene))


def build_stream(scene: Scene, detector: Mapping[str, Any] | None = None) -> TouchStream:
    """Build the detectors of a scene's sensors, as ``build_core`` does."""
    from coneskin.skin.detection.frame.settings import DetectorSettings
    from coneskin.skin.detection.frame.timing import TimingLimits
    from coneskin.skin.detection.stream import TouchStream

    limits = scene.monitoring_limits
    timing = TimingLimits(late=limits.skin_silence, clock_drift=limits.clock_drift)
    settings = DetectorSettings(stuck_frames=limits.stuck_frames, timing=timing, **(detector or {}))
    return TouchStream(known_sensors(scene), settings)


def known_sensors(scene: Scene) -> list[Sensor]:
    """Return a scene's sensors with what their untouched sheets were when they were commissioned."""
    known = scene.commissioning.sheet_ohm if scene.commissioning else {}
    own = [item.sensor for item in scene.sensors]
    return [replace(one, known_ohms=known.get(one.number, one.known_ohms)) for one in own]


def withheld_motion(scene: Scene) -> str:
    """Return why the arm of a scene only stops where a reaction would move it; empty where it may, or none does."""
    if not scene.moves_away or (scene.commissioning is not None and scene.commissioning.valid):
        return ""
    return scene.commissioning.note if scene.commissioning else "nobody has looked for a commissioning record"


def bare_parts(scene: Scene) -> str:
    """Return the parts of the arm without a skin, where no reaction may move it if one leads; empty where it may."""
    reactions = scene.default_reaction, *(rule.reaction for rule in scene.rules)
    if scene.arm is None or not any(one.moves and one.bare_lead == "stop" for one in reactions):
        return ""
    from coneskin.robot.reaction.bare_side import BareSides

    sheets = [(item.link, item.frustum) for item in place_on_frusta(scene)]
    return ", ".join(BareSides(scene.arm.arm_model, sheets).parts)


def _arm(scene: Scene, placed: Sequence[SensorOnArm]) -> ArmSupervisor:
    from coneskin.robot.arm.inertia import held_braking
    from coneskin.robot.driver.protocol import HeartbeatDriver
    from coneskin.robot.driver.values import EXTERNAL_PATHS, INTERNAL_PATHS, StopPath
    from coneskin.robot.guard.arm_supervisor import ArmSupervisor
    from coneskin.robot.reaction.rules import RuleSet

    assert scene.arm is not None
    arm, driver = scene.arm.arm_model, scene.arm.driver
    rules = RuleSet(scene.default_reaction, scene.rules)
    if withheld_motion(scene):
        rules = rules.without_motion()  # a mirrored or exchanged skin would retreat into the person
    internal = scene.arm.control == "internal"
    own = frozenset({StopPath.DRIVER, StopPath.WATCHDOG}).union(*driver.lost_with.values())
    if not scene.arm.slider_stop:
        own -= {StopPath.SLIDER}
    paths = tuple(path for path in (INTERNAL_PATHS if internal else EXTERNAL_PATHS) if path in own)
    held = held_braking(scene.arm.model, scene.arm.payload, scene.arm.payload_xyz)
    planner = None
    if rules.move:
        from coneskin.robot.guard.motion.setpoint_stream import ReactionPlanner
        from coneskin.robot.reaction.bare_side import BareSides

        watchdog = None if internal else scene.arm.watchdog_hz
        bare = BareSides(arm, [(item.link, item.frustum) for item in placed])
        planner = ReactionPlanner(arm, watchdog, scene.arm.table_z, bare, held)
    heartbeat = None
    if not internal and isinstance(driver, HeartbeatDriver):
        from coneskin.robot.guard.controller_heartbeat import ControllerHeartbeat

        heartbeat = ControllerHeartbeat(scene.arm.controller_heartbeat == "required")
    limit = None if scene.speed_limit is None else _speed_limit(scene, scene.speed_limit, arm)
    return ArmSupervisor(arm, driver, rules, scene.monitoring_limits, paths, planner, heartbeat, limit, held)


def _speed_limit(scene: Scene, limit: SpeedLimitScene, arm: ArmModel) -> SpeedLimit:
    """Build the limit of the speed; a place between two patches is faster than they are by at most a little."""
    from coneskin.robot.guard.speed.permissible_speeds import PermissiblePatch, PermissibleSpeeds
    from coneskin.robot.guard.speed.speed_limit import SpeedLimit

    places = {item.name: item for item in place_on_frusta(scene)}  # the speed of the mesh below is the same
    patches = []
    for patch in limit.patches:
        at = places[patch.sensor]
        curve, any_curve = limit.curves[patch.curve], limit.curves[patch.any_curve]
        patches.append(PermissiblePatch(patch.sensor, at.link, *at.place(patch.u, patch.phi), curve, any_curve))
    widest = 0.0  # angle between two normals, in the middle of which the speed along the normal may be greatest
    for name, at in places.items():
        closed = at.frustum.frustum.wrap > 2.0 * math.pi - 1e-9
        of_sensor = [patch for patch in limit.patches if patch.sensor == name]
        for u in {patch.u for patch in of_sensor}:
            normals = [at.place(u, phi)[1] for phi in sorted(patch.phi for patch in of_sensor if patch.u == u)]
            for a, b in pairwise((*normals, *normals[: 1 if closed else 0])):
                widest = max(widest, 2.0 * math.asin(min(1.0, 0.5 * math.dist(a, b))))
    between = 1.0 / max(0.1, math.cos(0.5 * widest))
    speeds = PermissibleSpeeds(limit.levers, tuple(patches), limit.lowest, limit.highest, between)
    return SpeedLimit(arm, speeds)


@dataclass(frozen=True, slots=True)
class SensorOnArm:
    """Place of a sensor on the arm."""

    name: str  #: of the sensor
    link_name: str  #: of the link
    link: int  #: index of the link's DH frame; 0 without an arm
    frustum: PlacedFrustum  #: in that frame; without an arm, in the frame that the scene gives
    surface: DisplacementMap | None = None  #: the link's mesh below the sensor, where the scene names one
    model: ArmModel | None = None  #: of the arm, or None

    def place(self, u: float, phi: float) -> tuple[Vector, Vector]:
        """Return the point [m] and the outward unit normal at u [m] and phi [rad].

        The point is on the link's mesh where the scene names one, else on the frustum; the normal is the frustum's,
        which is smooth where that of the facets jumps.
        """
        return (self.surface or self.frustum).point(u, phi), self.frustum.normal(phi)

    def place_in_base(self, u: float, phi: float, q: Sequence[float]) -> tuple[Vector, Vector]:
        """Return point [m] and outward unit normal at u [m] and phi [rad] in the base frame, at joint angles q [rad].

        Raises:
            KinematicsError: the scene has no arm.
        """
        if self.model is None:
            raise KinematicsError(f"{self.name} is on no arm: the scene has no [arm]")
        from coneskin.robot.arm.kinematics import link_pose

        point, normal = self.place(u, phi)
        base_link = link_pose(self.model, q, self.link)
        return base_link.apply(point), base_link.rotate(normal)


def place_on_arm(scene: Scene, surfaces: Mapping[str, Floats] | None = None) -> list[SensorOnArm]:
    """Return the places of the scene's sensors on its arm.

    Args:
        surfaces: heights of the links' meshes below the sensors, by their names, as a recording carries them; None to
            measure them on the mesh files.

    Raises:
        SceneError: a sensor lies on a mesh that is not in ``surfaces``.
        MeshError: a mesh cannot be read.
        GeometryError: a mesh is not near the sensor on it.
    """
    from coneskin.geometry.pose import Pose

    placed = []
    for link in scene.links:
        index, dh_frame, arm = 0, Pose(), None
        if scene.arm is not None:
            from coneskin.robot.arm.kinematics import dh_link, dh_mesh, link_index

            index, arm = link_index(link.name), scene.arm.arm_model
            if link.frame != "dh":
                dh_frame = dh_mesh(arm, link.name) if link.frame == "mesh" else dh_link(arm, link.name)
        frusta = [item.placed.moved(dh_frame) for item in link.sensors]
        on_mesh: Sequence[DisplacementMap | None] = [None] * len(frusta)
        if link.mesh and surfaces is None:
            on_mesh = _measured(link.mesh, Pose() if arm is None else dh_mesh(arm, link.name), frusta)
        elif link.mesh and surfaces is not None:
            on_mesh = [
                _carried(scene, item.sensor.name, at, surfaces) for item, at in zip(link.sensors, frusta, strict=True)
            ]
        for item, frustum, surface in zip(link.sensors, frusta, on_mesh, strict=True):
            placed.append(SensorOnArm(item.sensor.name, link.name, index, frustum, surface, arm))
    return placed


def place_on_frusta(scene: Scene) -> list[SensorOnArm]:
    """Return the places of a scene's sensors where their frusta suffice: no mesh is read."""
    return place_on_arm(replace(scene, links=tuple(replace(link, mesh=None) for link in scene.links)))


def _carried(scene: Scene, name: str, frustum: PlacedFrustum, surfaces: Mapping[str, Floats]) -> DisplacementMap:
    from coneskin.geometry.displacement_map import DisplacementMap

    if name not in surfaces:
        why = f"the recording does not carry the mesh below {name}, and no file that it names is opened; name --scene"
        raise SceneError([why], scene.name)
    return DisplacementMap(frustum, surfaces[name])


def _measured(path: Path, dh_mesh_frame: Pose, frusta: list[PlacedFrustum]) -> list[DisplacementMap]:
    """Measure the mesh below each sensor. A sensor has a thickness, so the mesh may be that much below it."""
    from coneskin.geometry.displacement_map import measure_displacement
    from coneskin.geometry.mesh import load_mesh
    from coneskin.geometry.ray_casting import RayCaster

    mesh = load_mesh(path).moved(dh_mesh_frame)
    rays = RayCaster(mesh)
    return [measure_displacement(mesh, frustum, 64, 128, limit=_MAX_DEPTH, rays=rays) for frustum in frusta]


_MAX_NODES = 2048  # of a grid, along and around; ``_measured`` makes 65 x 129


def encode_surfaces(placed: Iterable[SensorOnArm], time: float) -> list[Block]:
    """Return a block, with a host time [s], for each sensor that lies on a mesh."""
    from coneskin.core.recording.block import Block
    from coneskin.robot.guard.signals.journal import BlockKind

    blocks = []
    for item in placed:
        if item.surface is not None:
            rows, columns = item.surface.heights.shape
            head = json.dumps({"sensor": item.name, "rows": rows, "columns": columns}).encode()
            payload = head + b"\n" + item.surface.heights.astype("<f8").tobytes()
            blocks.append(Block(BlockKind.SURFACE, time, payload))
    return blocks


def decode_surfaces(blocks: Iterable[Block]) -> dict[str, Floats]:
    """Return the heights of the meshes [m] by the names of the sensors, from a recording's blocks of any kind.

    Raises:
        RecordingError: a block of this kind holds no grid of finite heights.
    """
    from coneskin.robot.guard.signals.journal import BlockKind

    return dict(_decode_surface(block) for block in blocks if block.kind == BlockKind.SURFACE)


def _decode_surface(block: Block) -> tuple[str, Floats]:
    import numpy as np

    head, _, body = block.payload.partition(b"\n")
    try:
        facts: dict[str, Any] = read_json(head)
        name, shape = facts["sensor"], (facts["rows"], facts["columns"])
        if not all(type(count) is int and 2 <= count <= _MAX_NODES for count in shape):
            raise ValueError(f"its grid has {shape[0]!r} x {shape[1]!r} nodes")
        heights = np.frombuffer(body, "<f8").reshape(shape)
        if not isinstance(name, str) or not np.isfinite(heights).all():
            raise ValueError("its name is no text, or a height is not finite")
    except (ValueError, TypeError, KeyError) as exc:
        raise RecordingError(f"the block of {block.time:.6f} s holds no surface of a sensor: {exc}") from exc
    return name, heights
