"""Guard monitor: it checks the guard's heartbeat and triggers the fallback stop when the guard is gone or hangs.

Any block of the guard is a heartbeat: a guard that lives reports every few milliseconds. The fallback stop is used for
an externally controlled arm only; with internal control the driver process stops the arm.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from coneskin.core.channel import Channel, wait_readable
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.registry import load_driver
from coneskin.robot.guard.signals.journal import EventName

from .event_log import EventLog
from .outcome import NOT_CONFIRMED, STANDS, reasons

if TYPE_CHECKING:
    from coneskin.robot.stop.backup_stop import StandstillHold
    from coneskin.scene.values.scene import Scene

__all__ = ["FallbackStop", "GuardMonitor", "stop_settings"]

_SESSION_HEARTBEAT_TIMEOUT = 1.0  # s; by then the driver process, or the guard watchdog, has acted, if it can
_ACTIVATION_TIME = 2.0  # s in which a guard mostly becomes active; later it is said what is wrong with the skin's line
_POLL_PERIOD = 0.01  # s between two looks at an arm without a guard
_CLOSE_TIMEOUT = 3.0  # s that a stop may still take after ``close``


class GuardMonitor:
    """Monitor of one guard, from a thread of its own, until the guard's channel ends.

    Args:
        log: takes what the guard reports.
        channel: the guard's.
        fallback: holds the arm at standstill, in that thread, while an active guard is silent or has ended
            unannounced; None where that is the task of another process.
        describe_line: says what is wrong with the skin's line, given why the guard waits; empty where nothing is.

    Attributes:
        lost: what is wrong with a guard that hangs, or has ended unannounced; empty while its heartbeat comes.
    """

    def __init__(
        self,
        log: EventLog,
        channel: Channel,
        fallback: FallbackStop | None = None,
        describe_line: Callable[[Sequence[str]], str] = lambda _: "",
    ) -> None:
        self.lost = ""
        self._log = log
        self._channel = channel
        self._fallback = fallback
        self._describe_line = describe_line
        self._closing_since: float | None = None  # when ``close`` was called
        self._thread = threading.Thread(target=self._run, name="coneskin guard monitor", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Wait for the end of the guard's channel; may be called again."""
        self._closing_since = time.monotonic()
        if self._thread.is_alive():
            self._thread.join()

    # ---- the thread

    def _run(self) -> None:
        try:
            self._listen()
            self._log.end()
            if self.lost:
                self._stand_in()
        except Exception:
            logging.getLogger("coneskin").exception("the guard is not monitored any more")
        finally:
            self._log.end()
            if self._fallback is not None:
                self._fallback.end()

    def _listen(self) -> None:
        """Take what the guard sends until its channel ends."""
        channel, heard_at = self._channel, time.monotonic()
        look_at = heard_at + _ACTIVATION_TIME

        def over() -> bool:
            return bool(wait_readable([channel], 0.0))

        while not channel.closed:
            wait_readable([channel], _POLL_PERIOD if self.lost and self._fallback else _SESSION_HEARTBEAT_TIMEOUT)
            if data := b"".join(channel.receive()):
                heard_at = time.monotonic()
                self._note_heartbeat()
                self._log.feed(data)
                if heard_at >= look_at:
                    look_at = math.inf
                    self._look_at_line()
            elif channel.closed:
                break
            elif self.lost:
                self._hold(over)
            elif time.monotonic() - heard_at >= _SESSION_HEARTBEAT_TIMEOUT and self._is_active():
                self.lost = f"the guard hangs: it has sent nothing for {_SESSION_HEARTBEAT_TIMEOUT:g} s"
                self._log.report(EventName.GUARD_UNRESPONSIVE, what=self.lost)
                self._hold(over)
        if self._is_active():
            self.lost = "the guard's process has ended unannounced: the arm is no longer monitored"
            # it may have reported its reason itself
            if not any(event.name is EventName.GUARD_EXITED for event in self._log.events):
                self._log.report(EventName.GUARD_EXITED, what=self.lost)

    def _look_at_line(self) -> None:
        """Say what is wrong with the skin's line, where the guard still waits for it."""
        waiting = next((e for e in reversed(self._log.events) if e.name == EventName.WAITING), None)
        if not self._log.activated and waiting is not None and (words := self._describe_line(reasons(waiting))):
            self._log.report(EventName.SKIN_LINE, what=words)

    def _is_active(self) -> bool:
        """Tell whether the guard has become active and has not begun to end."""
        return self._log.activated and not self._log.ending

    def _note_heartbeat(self) -> None:
        """Note that the heartbeat is back: whatever was wrong, the guard reports itself."""
        if self.lost:
            self.lost = ""
            self._log.report(EventName.GUARD_RESPONSIVE, what="the guard's heartbeat is back")
            if self._fallback is not None:
                self._fallback.end()

    def _stand_in(self) -> None:
        """Hold the arm at standstill until ``close``: the guard is gone for good."""

        def over() -> bool:
            return self._closing_since is not None and time.monotonic() - self._closing_since > _CLOSE_TIMEOUT

        while self._fallback is not None:
            self._hold(over)
            if self._closing_since is not None and (self._fallback.stands or over()):
                return
            time.sleep(_POLL_PERIOD)

    def _hold(self, over: Callable[[], bool]) -> None:
        if self._fallback is None or not self._fallback.poll(over):
            return
        stands = self._fallback.stands
        what = f"stopped by the session, without the guard: {STANDS if stands else NOT_CONFIRMED}"
        self._log.report(EventName.FALLBACK_STOP, what=what, stands=stands)


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

    def poll(self, over: Callable[[], bool]) -> bool:
        """Stop the arm at the first call, and whenever something moves it. To be called continuously.

        Args:
            over: asked while a stop is under way; True ends it as it is.

        Returns:
            whether there is an outcome to report, which is ``stands``.
        """
        return self._open().poll(over)

    @property
    def stands(self) -> bool:
        """True where the arm was seen standing for a whole watch after the newest stop, and ever since."""
        return self._hold is not None and self._hold.stands

    def end(self) -> None:
        """Close the connections; ``poll`` opens new ones. For when the guard lives again, or nothing is left to do."""
        self._close()
        self._hold = None

    def _open(self) -> StandstillHold:
        if self._hold is None:
            from coneskin.robot.stop.backup_stop import BackupStop, StandstillHold
            from coneskin.robot.stop.limits import MonitoringLimits

            settings = self._settings
            limits = MonitoringLimits(**settings["monitoring"])
            connections = self._driver.stop_connections(settings["host"], _CONNECT_TIMEOUT)
            stop = BackupStop(self._driver, connections, limits, settings["deceleration"])
            self._close = stop.close
            self._hold = StandstillHold(stop, limits.standstill)
        return self._hold
