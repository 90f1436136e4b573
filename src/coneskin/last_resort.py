"""Stops the arm of a scene whose guard is gone: what a process has to know to do so, and doing it from here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .robot.vigil import Vigil
    from .scene import Scene

__all__ = ["LastResort", "keeping"]

_CONNECT = 0.5  # s for each port; a controller that takes longer is tried again


def keeping(scene: Scene) -> dict[str, Any]:
    """What the owner, or the keeper, has to know to stop the arm."""

    assert scene.arm is not None
    deceleration = scene.any_touch.deceleration
    return {"host": scene.arm.host, "watch": asdict(scene.limits), "deceleration": deceleration}


class LastResort:
    """Keeps an arm that is not ours standing, from this process: its guard is gone, and its keeper may be.

    A stop from two sides at once does no harm, so nobody asks whether the keeper acts. Nothing is opened before it is
    needed, and a port that does not answer keeps no other from being used.

    Args:
        scene: whose arm it is.
    """

    def __init__(self, scene: Scene) -> None:
        self._known = keeping(scene)
        self._vigil: Vigil | None = None
        self._close: Callable[[], None] = lambda: None

    def look(self, over: Callable[[], bool]) -> bool:
        """Call it all the time: stop the arm the first time, and whenever something moves it.

        Args:
            over: asked while a stop is under way; True ends it as it is.

        Returns:
            whether there was a stop; ``stands`` says what became of it.
        """
        return self._watch().look(over)

    @property
    def stands(self) -> bool:
        """Whether the arm was seen standing after the newest stop."""
        return self._vigil is not None and self._vigil.stands

    def end(self) -> None:
        """The guard lives again, or nothing is left to do: close the connections. ``look`` opens new ones."""
        self._close()
        self._vigil = None

    def _watch(self) -> Vigil:
        if self._vigil is None:
            from .robot.foreign import ForeignStops
            from .robot.stopper import Stopper
            from .robot.vigil import Vigil
            from .robot.watch import Watch

            watch = Watch(**self._known["watch"])
            stopper = Stopper(ForeignStops(self._known["host"], _CONNECT), watch, self._known["deceleration"])
            self._close = stopper.close
            self._vigil = Vigil(stopper, watch.standstill)
        return self._vigil
