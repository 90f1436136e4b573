"""Stops the arm of a scene whose guard is gone: what a process has to know to do so, and doing it from here."""

from __future__ import annotations

import contextlib
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from .errors import ConeSkinError

if TYPE_CHECKING:
    from .scene import Scene

__all__ = ["keeping", "stop_the_arm"]


def keeping(scene: Scene) -> dict[str, Any]:
    """What the owner, or the keeper, has to know to stop the arm."""
    from .robot.commands import Reaction
    from .robot.watch import Watch

    assert scene.arm is not None
    deceleration = (scene.reaction or Reaction(kind="stop")).deceleration
    return {"host": scene.arm.host, "watch": asdict(scene.watch or Watch()), "deceleration": deceleration}


def stop_the_arm(scene: Scene) -> None:
    """The guard is gone, and its keeper may be: nobody else is left that can stop an arm that is not ours."""
    from .robot.foreign import ForeignStops
    from .robot.state_reader import StateReader
    from .robot.stopper import Stopper
    from .robot.watch import Watch

    known = keeping(scene)
    with (
        contextlib.suppress(ConeSkinError),
        ForeignStops(known["host"]) as stops,
        StateReader(known["host"]) as reader,
    ):
        Stopper(stops, reader, Watch(**known["watch"]), known["deceleration"]).stop()
