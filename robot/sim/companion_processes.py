"""Companion processes of a guard core in a test: their heartbeats, acknowledgements and resets."""

from collections.abc import Iterator

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import Release, StatusReport
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent

__all__ = ["CompanionProcesses"]

_PERIOD = 0.02  # s between two heartbeats


class CompanionProcesses:
    """Program that guards, and driver process or guard watchdog, as far as a core hears them.

    Attributes:
        program_is_mute: True where the program sends no heartbeat.
        process_is_mute: True where driver process or guard watchdog sends nothing.
    """

    def __init__(self) -> None:
        self.program_is_mute = self.process_is_mute = False
        self._ready = False
        self._due = 0.0
        self._release: Release | None = None
        self._latched_stop = self._request = 0

    def take(self, output: object) -> None:
        """Take an output of the core."""
        if isinstance(output, Release):
            self._release = output
        elif isinstance(output, GuardEvent) and output.name == EventName.LATCHED:
            self._latched_stop = output.details["stop"]

    def blocks(self, now: float) -> Iterator[Block]:
        """Return what they say by a host time [s]; to be asked continuously."""
        due = now >= self._due
        if due:
            self._due = now + _PERIOD
        if due and not self.program_is_mute:
            yield Block(BlockKind.PROGRAM, now, b"")
        if self.process_is_mute:
            return
        if not self._ready:
            self._ready = True
            yield _report(now, "ready")
        if due:
            yield _report(now, "alive")
        if self._release is not None:
            number, self._release = self._release.number, None
            yield _report(now, "released", str(number))

    def reset(self, now: float) -> Block:
        """Return a person's reset of the newest stop that has latched the arm, at a host time [s]."""
        self._request += 1
        return Block(BlockKind.RESET, now, b"%d %d" % (self._latched_stop, self._request))


def _report(now: float, kind: str, text: str = "") -> Block:
    return Block(BlockKind.DRIVER, now, StatusReport(kind, text).encode())
