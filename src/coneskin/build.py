"""From a scene to the guard's parts. Only what the scene names is imported and built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .errors import SceneError

if TYPE_CHECKING:
    from .geometry.placed import PlacedFrustum
    from .geometry.pose import Vector
    from .robot.arm_reaction import ArmReaction
    from .robot.guard_core import GuardCore
    from .robot.watch import Watch
    from .scene import Scene

__all__ = ["OnArm", "build_core", "place_on_arm"]


def build_core(scene: Scene) -> GuardCore:
    """The guard's core for a scene; the same for the live guard and for a replay.

    Raises:
        SceneError: the scene has no sensor to guard with.
    """
    if not scene.sensors:
        raise SceneError(["a guard needs a [[link]] with a [[link.sensor]]"], scene.name)
    from .robot.guard_core import GuardCore, GuardedSensor
    from .robot.watch import Watch
    from .skin.detector import Detection
    from .skin.stream import Stream
    from .skin.timing import TimingLimits

    watch = scene.watch or Watch()
    detection = Detection(stuck_frames=watch.stuck_frames, timing=TimingLimits(late=watch.skin_late))
    stream = Stream([item.sensor for item in scene.sensors], detection)
    sensors = [GuardedSensor(item.name, item.link_name, item.link, item.place) for item in place_on_arm(scene)]
    return GuardCore(stream, sensors, watch, _arm(scene, watch) if scene.arm else None)


def _arm(scene: Scene, watch: Watch) -> ArmReaction:
    from .robot.arm_reaction import ArmReaction
    from .robot.commands import Reaction
    from .robot.compiled import compile_contact
    from .robot.link_frames import link_index
    from .robot.stop_watch import Way
    from .robot.ur_models import model

    assert scene.arm is not None
    arm = model(scene.arm.model)
    for link in scene.links:
        if index := link_index(link.name):
            compile_contact(arm, index)  # 2 ms that the first touch shall not wait for
    return ArmReaction(arm, scene.reaction or Reaction(kind="stop"), watch, tuple(Way))


@dataclass(frozen=True, slots=True)
class OnArm:
    """A sensor's place on the arm.

    Attributes:
        name: of the sensor.
        link_name: of the link.
        link: index of the link's DH frame; 0 without an arm.
        frustum: in that frame; without an arm, in the frame that the scene gives.
    """

    name: str
    link_name: str
    link: int
    frustum: PlacedFrustum

    def place(self, u: float, phi: float) -> tuple[Vector, Vector]:
        """Point [m] and outward unit normal at u [m] and phi [rad]."""
        return self.frustum.point(u, phi), self.frustum.normal(phi)


def place_on_arm(scene: Scene) -> list[OnArm]:
    """Where the scene's sensors are on its arm."""
    from .geometry.placed import PlacedFrustum
    from .geometry.pose import Pose

    placed = []
    for link in scene.links:
        index, dh_frame = 0, Pose()
        if scene.arm is not None:
            from .robot.link_frames import dh_mesh, link_index
            from .robot.ur_models import model

            index = link_index(link.name)
            if link.frame == "mesh":
                dh_frame = dh_mesh(model(scene.arm.model), link.name)
        for item in link.sensors:
            frustum = PlacedFrustum(item.placed.frustum, dh_frame @ item.placed.link_frustum)
            placed.append(OnArm(item.sensor.name, link.name, index, frustum))
    return placed
