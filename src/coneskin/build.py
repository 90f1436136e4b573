"""From a scene to the guard's parts. Only what the scene names is imported and built."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .errors import SceneError

if TYPE_CHECKING:
    from pathlib import Path

    from .geometry.placed import PlacedFrustum
    from .geometry.pose import Pose, Vector
    from .robot.arm_reaction import ArmReaction
    from .robot.guard_core import GuardCore
    from .robot.mover import Mover
    from .robot.ur_models import ArmModel
    from .scene import Scene

__all__ = ["OnArm", "build_core", "place_on_arm"]

_BELOW = 0.012  # m that a mesh may lie below the sensor on it: five layers, and what the fit left over


def build_core(scene: Scene) -> GuardCore:
    """The guard's core for a scene; the same for the live guard and for a replay.

    Raises:
        SceneError: the scene has no sensor to guard with.
    """
    if not scene.sensors:
        raise SceneError(["a guard needs a [[link]] with a [[link.sensor]]"], scene.name)
    from .robot.contact import GuardedSensor
    from .robot.guard_core import GuardCore
    from .skin.detection import Detection
    from .skin.stream import Stream
    from .skin.timing import TimingLimits

    watch = scene.limits
    detection = Detection(stuck_frames=watch.stuck_frames, timing=TimingLimits(late=watch.skin_late))
    stream = Stream([item.sensor for item in scene.sensors], detection)
    touched = {item.sensor.name: item.sensor.thresholds.touch_level for item in scene.sensors}
    sensors = [
        GuardedSensor(item.name, item.link_name, item.link, item.place, touched[item.name])
        for item in place_on_arm(scene)
    ]
    return GuardCore(stream, sensors, watch, _arm(scene) if scene.arm else None)


def _arm(scene: Scene) -> ArmReaction:
    from .robot.arm_reaction import ArmReaction
    from .robot.rules import Rules
    from .robot.stop_watch import FOREIGN, OWNED
    from .robot.ur_models import model

    assert scene.arm is not None
    arm = model(scene.arm.model)
    reaction = scene.any_touch
    ways = OWNED if scene.arm.control == "owner" else FOREIGN
    mover = _mover(scene, arm) if Rules(reaction, scene.rules).move else None
    return ArmReaction(arm, reaction, scene.limits, ways, scene.rules, mover)


def _mover(scene: Scene, arm: ArmModel) -> Mover:
    from .robot.compiled import compile_contact
    from .robot.link_frames import link_index
    from .robot.mover import Mover
    from .robot.table import Table

    assert scene.arm is not None
    for link in scene.links:
        if index := link_index(link.name):
            compile_contact(arm, index)  # 2 ms that the first touch shall not wait for
    table = None if scene.arm.table_z is None else Table(scene.arm.table_z)
    return Mover(arm, scene.arm.watchdog_hz if scene.arm.control == "foreign" else None, table)


@dataclass(frozen=True, slots=True)
class OnArm:
    """A sensor's place on the arm.

    Attributes:
        name: of the sensor.
        link_name: of the link.
        link: index of the link's DH frame; 0 without an arm.
        frustum: in that frame; without an arm, in the frame that the scene gives.
        surface: the link's mesh below the sensor, where the scene names one: (u [m], phi [rad]) -> point [m].
    """

    name: str
    link_name: str
    link: int
    frustum: PlacedFrustum
    surface: Callable[[float, float], Vector] | None = None

    def place(self, u: float, phi: float) -> tuple[Vector, Vector]:
        """Point [m] and outward unit normal at u [m] and phi [rad].

        The point is on the link's mesh where the scene names one, else on the frustum; the normal is the frustum's,
        which is smooth where that of the facets jumps.
        """
        return (self.surface or self.frustum.point)(u, phi), self.frustum.normal(phi)


def place_on_arm(scene: Scene) -> list[OnArm]:
    """Where the scene's sensors are on its arm."""
    from .geometry.placed import PlacedFrustum
    from .geometry.pose import Pose

    placed = []
    for link in scene.links:
        index, dh_mesh_frame, dh_frame = 0, Pose(), Pose()
        if scene.arm is not None:
            from .robot.link_frames import dh_link, dh_mesh, link_index
            from .robot.ur_models import model

            index = link_index(link.name)
            dh_mesh_frame = dh_mesh(model(scene.arm.model), link.name)
            frames = {"mesh": dh_mesh_frame, "urdf": dh_link(model(scene.arm.model), link.name), "dh": Pose()}
            dh_frame = frames[link.frame]
        frusta = [PlacedFrustum(item.placed.frustum, dh_frame @ item.placed.link_frustum) for item in link.sensors]
        surfaces = _surfaces(link.mesh, dh_mesh_frame, frusta) if link.mesh else [None] * len(frusta)
        for item, frustum, surface in zip(link.sensors, frusta, surfaces, strict=True):
            placed.append(OnArm(item.sensor.name, link.name, index, frustum, surface))
    return placed


def _surfaces(
    path: Path, dh_mesh_frame: Pose, frusta: list[PlacedFrustum]
) -> Sequence[Callable[[float, float], Vector] | None]:
    """The mesh below each sensor. A sensor has a thickness, so the mesh may be that much below it."""
    from .geometry.displacement import measure_displacement
    from .geometry.mesh import load_mesh
    from .geometry.rays import Rays

    mesh = load_mesh(path).moved(dh_mesh_frame)
    rays = Rays(mesh)
    return [measure_displacement(mesh, frustum, 64, 128, limit=_BELOW, rays=rays).point for frustum in frusta]
