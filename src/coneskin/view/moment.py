"""Moment of a run: all that moves or changes on the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coneskin.geometry.pose import Pose, Vector

    from .contact_mark import ContactMark
    from .history import History
    from .phase_words import PhaseWords
    from .stage.stage import Stage

__all__ = ["Moment", "moment_at"]


@dataclass(frozen=True, slots=True)
class Moment:
    """What is seen at one time.

    Attributes:
        time: [s, host clock].
        poses: of the links' frames in the base frame, by their indices.
        levels: of the sensors, by their names.
        marks: of contacts.
        phase: of the guard.
        health: what is wrong; empty where nothing is.
        force: between the arm and what it meets [N]; None where nothing tells.
        bodies: how far each part of a body is from where the scene puts it [m].
    """

    time: float
    poses: dict[int, Pose]
    levels: dict[str, float]
    marks: list[ContactMark]
    phase: PhaseWords
    health: str
    force: float | None = None
    bodies: tuple[Vector, ...] = ()


def moment_at(stage: Stage, history: History, time: float) -> Moment:
    """Return what is seen at a time [s, host clock]."""
    levels = {sheet.name: history.level(sheet.name, time) for sheet in stage.sheets}
    poses = stage.poses(history.q(time))
    seen = history.marks(time), history.phase(time), history.health(time), history.force(time)
    return Moment(time, poses, levels, *seen, stage.moved(history.places(time)))
