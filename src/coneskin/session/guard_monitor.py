"""Guard monitor: it takes what guard and guard watchdogs report, and notices that the guard is gone or hangs.

Any block of the guard is a heartbeat: a guard that lives reports every few milliseconds. Who stops the arm without it
is another process: the driver process, or the guard watchdogs.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Sequence

from coneskin.core.channel import Channel, decode_json, wait_readable
from coneskin.robot.driver.liveness import UNGUARDED_TIME
from coneskin.robot.guard.signals.journal import EventName

from .event_log import EventLog
from .outcome import NOT_CONFIRMED, STANDS, reasons

_REPORT_PERIOD = 0.05  # s between two looks for what the watchdogs of a lost guard report
_ACTIVATION_TIME = 2.0  # s in which a guard mostly becomes active; later it is said what is wrong with the skin's line


class GuardMonitor:
    """Monitor of one guard, from a thread of its own, until the guard's channel ends.

    Args:
        watchdogs: channels of the guard watchdogs, which hold the arm at standstill without a guard.
        describe_line: says what is wrong with the skin's line, given why the guard waits; empty where nothing is.

    Attributes:
        lost: what is wrong with a guard that hangs, or has ended unannounced; empty while its heartbeat comes.
    """

    def __init__(
        self,
        log: EventLog,
        channel: Channel,
        watchdogs: Sequence[Channel] = (),
        describe_line: Callable[[Sequence[str]], str] = lambda _: "",
    ) -> None:
        self.lost = ""
        self._log = log
        self._channel = channel
        self._watchdogs = watchdogs
        self._describe_line = describe_line
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="coneskin guard monitor", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Wait for the end of the guard's channel; may be called again, once the other processes have ended."""
        self._closing.set()
        self._thread.join()

    # ---- the thread

    def _run(self) -> None:
        try:
            self._listen()
            self._log.end()
            while self.lost and not self._closing.is_set():
                self._hear_watchdogs(_REPORT_PERIOD)
            self._hear_watchdogs(0.0)
        except Exception:
            logging.getLogger("coneskin").exception("the guard is not monitored any more")
        finally:
            self._log.end()

    def _listen(self) -> None:
        """Take what the guard sends until its channel ends."""
        channel, heard_at = self._channel, time.monotonic()
        look_at = heard_at + _ACTIVATION_TIME
        while not channel.closed:
            wait_readable([channel], _REPORT_PERIOD if self.lost else UNGUARDED_TIME)
            self._hear_watchdogs(0.0)
            if data := b"".join(channel.receive()):
                heard_at = time.monotonic()
                if self.lost:  # whatever was wrong, the guard reports itself
                    self.lost = ""
                    self._log.report(EventName.GUARD_RESPONSIVE, what="the guard's heartbeat is back")
                self._log.feed(data)
                if heard_at >= look_at:
                    look_at = math.inf
                    self._look_at_line()
            elif channel.closed:
                break
            elif not self.lost and time.monotonic() - heard_at >= UNGUARDED_TIME and self._is_active():
                self.lost = f"the guard hangs: it has sent nothing for {UNGUARDED_TIME:g} s"
                self._log.report(EventName.GUARD_UNRESPONSIVE, what=self.lost)
        if self._is_active():
            self.lost = "the guard's process has ended unannounced: the arm is no longer monitored"
            # it may have reported its reason itself
            if not any(event.name is EventName.GUARD_EXITED for event in self._log.events):
                self._log.report(EventName.GUARD_EXITED, what=self.lost)

    def _look_at_line(self) -> None:
        """Say what is wrong with the skin's line, where the guard still waits for it."""
        waiting = next((e for e in reversed(self._log.events) if e.name == EventName.WAITING), None)
        if not self._log.activated and waiting is not None and (words := self._describe_line(reasons(waiting))):
            self._log.report(EventName.SKIN_LINE, waiting.time, what=words)  # a busy guard's next event may be older

    def _is_active(self) -> bool:
        """Tell whether the guard has become active and has not begun to end."""
        return self._log.activated and not self._log.ending

    def _hear_watchdogs(self, timeout: float) -> None:
        """Wait for reports of the guard watchdogs, or for the timeout [s], and note them."""
        there = [channel for channel in self._watchdogs if not channel.closed]
        if not there:
            self._closing.wait(timeout)
        for channel in wait_readable(there, timeout) if there else ():
            for message in channel.receive():
                stands = bool(decode_json(message)["stands"])
                what = f"stopped by a guard watchdog, without the guard: {STANDS if stands else NOT_CONFIRMED}"
                self._log.report(EventName.FALLBACK_STOP, what=what, stands=stands)
