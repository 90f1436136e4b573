"""When a guard arms: everything has been sound for a while, at its start, or after a person's reset. Pure."""

from __future__ import annotations

from .outputs import Outputs, tell

__all__ = ["Arming"]

_TELL_EVERY = 0.5  # s between two lists of what the guard waits for


class Arming:
    """See the module.

    Args:
        settle: how long everything must be sound [s].
    """

    def __init__(self, settle: float) -> None:
        self._settle = settle
        self._sound_since: float | None = None
        self._told: float | None = None
        self._waiting_for: list[str] = []
        self._reset_at: float | None = None
        self._disturbed = False

    def disturb(self) -> None:
        """A touch has begun, however short it is."""
        self._disturbed = True

    @property
    def resetting(self) -> bool:
        """Whether a person has reset, and it is not yet clear what comes of it."""
        return self._reset_at is not None

    def reset(self, now: float) -> None:
        """A person has reset the guard at a time [s]."""
        self._reset_at, self._disturbed = now, False

    def starts(self, now: float, wrong: list[str], out: Outputs) -> bool:
        """Whether to arm for the first time; it waits as long as something is wrong."""
        if self._disturbed:
            self._sound_since, self._disturbed = None, False
        if wrong:
            self._sound_since = None
            if self._told is None:
                self._told = now
            elif wrong != self._waiting_for and now - self._told >= _TELL_EVERY:
                self._told, self._waiting_for = now, wrong
                tell(out, "waiting", now, reasons=wrong)
            return False
        if self._sound_since is None:
            self._sound_since = now
        return now - self._sound_since >= self._settle

    def settles(self, now: float, wrong: list[str], out: Outputs) -> bool:
        """Whether to arm after a reset; anything wrong meanwhile refuses it, and a person has to reset again."""
        if self._reset_at is None:
            return False
        if self._disturbed:
            wrong = [*wrong, "it was touched meanwhile"]
        if wrong:
            self._reset_at = None
            tell(out, "refused", now, what="reset", reasons=wrong)
        elif now - self._reset_at >= self._settle:
            self._reset_at = None
            return True
        return False
