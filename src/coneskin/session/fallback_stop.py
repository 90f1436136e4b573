"""Fallback stop: the session's own stop of an externally controlled arm whose guard is gone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.driver.registry import load_driver

if TYPE_CHECKING:
    from coneskin.robot.stop.standstill_hold import StandstillHold
    from coneskin.scene.values.scene import Scene

__all__ = ["FallbackStop", "stop_settings"]

_CONNECT_TIMEOUT = 0.5  # s for each port; a controller that takes longer is tried again


def stop_settings(scene: Scene) -> dict[str, Any]:
    """Return the settings with which a process can stop the arm of a scene."""
    assert scene.arm is not None
    return {
        "family": arm_model(scene.arm.model).family,
        "host": scene.arm.host,
        "monitoring": asdict(scene.monitoring_limits),
        "deceleration": scene.default_reaction.deceleration,
    }


class FallbackStop:
    """Standstill hold from this process: the guard is gone, and its watchdog may be gone too.

    A stop from two processes at once does no harm, so the watchdog is not asked. Connections are opened when they are
    needed; a port that does not answer does not prevent the use of another.

    Args:
        scene: whose arm it is.
    """

    def __init__(self, scene: Scene) -> None:
        self._settings = stop_settings(scene)
        self._driver = load_driver(self._settings["family"])  # now, and not when it is needed
        self._hold: StandstillHold | None = None
        self._close: Callable[[], None] = lambda: None

    def look(self, over: Callable[[], bool]) -> bool:
        """Stop the arm at the first call, and whenever something moves it. To be called continuously.

        Args:
            over: asked while a stop is under way; True ends it as it is.

        Returns:
            whether there is an outcome to report, which is ``stands``.
        """
        return self._open().look(over)

    @property
    def stands(self) -> bool:
        """True where the arm was seen standing for a whole watch after the newest stop, and ever since."""
        return self._hold is not None and self._hold.stands

    def end(self) -> None:
        """Close the connections; ``look`` opens new ones. For when the guard lives again, or nothing is left to do."""
        self._close()
        self._hold = None

    def _open(self) -> StandstillHold:
        if self._hold is None:
            from coneskin.robot.stop.backup_stop import BackupStop
            from coneskin.robot.stop.limits import MonitoringLimits
            from coneskin.robot.stop.standstill_hold import StandstillHold

            settings = self._settings
            limits = MonitoringLimits(**settings["monitoring"])
            connections = self._driver.stop_connections(settings["host"], _CONNECT_TIMEOUT)
            stop = BackupStop(self._driver, connections, limits, settings["deceleration"])
            self._close = stop.close
            self._hold = StandstillHold(stop, limits.standstill)
        return self._hold
