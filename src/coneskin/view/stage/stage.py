"""Stage: what is drawn once and then only moved: the arm's solids and the sheets on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from coneskin.geometry.pose import Pose, Vector

from .body_solids import body_solids
from .buried_sheets import clear_where_buried
from .sheet_surface import SheetSurface, sheet_surfaces
from .solid import Solid

if TYPE_CHECKING:
    from coneskin.robot.arm.model import ArmModel
    from coneskin.scene.build import SensorOnArm
    from coneskin.scene.values.scene import Scene

__all__ = ["Stage", "set_stage"]

#: joint positions of an arm of which nothing has been measured [rad]: it stands upright, its elbow bent
REST = (0.0, -1.5708, 1.2, -1.2, -1.5708, 0.0)
_SHELL = (201, 205, 210)


@dataclass(frozen=True, slots=True)
class Stage:
    """What is drawn once.

    Attributes:
        title: for people.
        model: of the arm; None where the scene has none.
        solids: of the arm.
        sheets: on it.
        bodies: around it, part by part, in the base frame where the scene puts them.
        starts: the places of those parts there [m].
    """

    title: str
    model: ArmModel | None
    solids: tuple[Solid, ...]
    sheets: tuple[SheetSurface, ...]
    bodies: tuple[Solid, ...] = ()
    starts: tuple[Vector, ...] = ()

    @property
    def links(self) -> tuple[int, ...]:
        """Indices of the frames that something moves with."""
        return tuple(sorted({0, *(solid.link for solid in self.solids), *(sheet.link for sheet in self.sheets)}))

    @property
    def reach(self) -> float:
        """How far anything can be from the base [m]."""
        if self.model is not None:
            return sum(map(abs, self.model.a)) + sum(map(abs, self.model.d))
        return max((float(abs(sheet.vertices).max()) for sheet in self.sheets), default=1.0)

    def same_shape(self, other: Stage) -> bool:
        """Tell whether another stage is drawn with the same nodes."""
        here: list[Solid | SheetSurface] = [*self.solids, *self.bodies, *self.sheets]
        there: list[Solid | SheetSurface] = [*other.solids, *other.bodies, *other.sheets]
        if self.model != other.model or len(here) != len(there) or len(self.sheets) != len(other.sheets):
            return False
        return all(
            (a.name, a.link, a.vertices.shape) == (b.name, b.link, b.vertices.shape)
            and bool((a.vertices == b.vertices).all())
            for a, b in zip(here, there, strict=True)
        )

    def poses(self, q: Sequence[float] | None) -> dict[int, Pose]:
        """Return the pose in the base frame of each link's frame at joint positions q [rad]; None: at rest."""
        if self.model is None:
            return {link: Pose() for link in self.links}
        from coneskin.robot.arm.kinematics import link_poses

        found = link_poses(self.model, REST if q is None else q)
        return {link: found[link] for link in self.links}

    def moved(self, places: Sequence[Vector]) -> tuple[Vector, ...]:
        """Return how far each part of a body is from where the scene puts it [m]: nowhere, unless all are told."""
        if len(places) != len(self.starts):
            return ((0.0, 0.0, 0.0),) * len(self.starts)
        return tuple((x - x0, y - y0, z - z0) for (x, y, z), (x0, y0, z0) in zip(places, self.starts, strict=True))


def set_stage(scene: Scene, placed: Sequence[SensorOnArm], title: str, meshes: bool = False) -> Stage:
    """Return the stage for a scene.

    Args:
        scene: with arm and sensors.
        placed: its sensors, as of ``place_on_arm``.
        title: for people.
        meshes: open the mesh files that the scene names, instead of making the link's solids from the arm's tables.

    Raises:
        KinematicsError: nobody knows where the tubes of the arm are.
        MeshError: a mesh cannot be read.
    """
    sheets = sheet_surfaces(placed, [item.sensor for item in scene.sensors])
    bodies, starts = tuple(body_solids(scene.bodies)), tuple(place for body in scene.bodies for place in body.parts)
    if scene.arm is None:
        return Stage(title, None, (), sheets, bodies, starts)
    from coneskin.robot.arm.ur_models import arm_model

    from .arm_solids import arm_solids

    model = arm_model(scene.arm.model)
    slimmest: dict[int, float] = {}
    for sheet in sheets:
        slimmest[sheet.link] = min(sheet.slimmest, slimmest.get(sheet.link, sheet.slimmest))
    solids = arm_solids(model, slimmest)
    if meshes:
        own = _link_meshes(scene, model)
        solids = (*(solid for solid in solids if solid.link not in {mesh.link for mesh in own}), *own)
    stage = Stage(title, model, tuple(solids), sheets, bodies, starts)
    return replace(stage, solids=clear_where_buried(solids, sheets, stage.poses(None)))


def _link_meshes(scene: Scene, model: ArmModel) -> list[Solid]:
    """Return the meshes of the links that name one, in the DH frames."""
    found = []
    for link in scene.links:
        if link.mesh is not None:
            import numpy as np

            from coneskin.geometry.mesh import load_mesh
            from coneskin.robot.arm.link_frames import dh_mesh, link_index

            mesh = load_mesh(link.mesh).moved(dh_mesh(model, link.name))
            faces = np.asarray(mesh.faces)
            found.append(Solid(f"{link.name}, mesh", link_index(link.name), np.asarray(mesh.vertices), faces, _SHELL))
    return found
