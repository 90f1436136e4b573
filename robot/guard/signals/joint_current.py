"""Joint-current monitor: it notices that a force resists a motion of ours, on the skin or beside it. Pure.

What the motors take beyond what the controller expects of the motion is friction, load and whatever pushes on the arm.
Friction and load change little while an arm moves away slowly. So each deviation is compared with the least one since
the motion began. The push of the touch itself fades while the arm moves away.
"""

from __future__ import annotations

from coneskin.robot.driver.values import ControllerState

__all__ = ["MAX_RISE", "JointCurrentMonitor"]

#: A by which a joint's current may deviate more than at its least since the motion began. Assumed, not measured on an
#: arm: with about 12 N m/A at base, shoulder and elbow, and 9 at the wrists, 25 and 9 N m.
MAX_RISE = (2.0, 2.0, 2.0, 1.0, 1.0, 1.0)
_RESISTED_SAMPLES = 5  # in a row, 10 ms; a single one may be noise


class JointCurrentMonitor:
    """Monitor of one reaction motion. It sees nothing where the controller sends no currents."""

    def __init__(self) -> None:
        self._least: list[float] | None = None
        self._beyond = 0  # samples in a row

    def resistance(self, state: ControllerState) -> str:
        """Take a measured state and return why the motion must end. Empty where it may go on."""
        if state.current is None or state.target_current is None:
            return ""
        off = [a - b for a, b in zip(state.current, state.target_current, strict=True)]
        least = self._least = off if self._least is None else list(map(_nearer_zero, self._least, off))
        rises = [abs(a - b) - most for a, b, most in zip(off, least, MAX_RISE, strict=True)]
        worst = max(range(len(rises)), key=rises.__getitem__)
        self._beyond = self._beyond + 1 if rises[worst] > 0.0 else 0
        if self._beyond < _RESISTED_SAMPLES:
            return ""
        rise = rises[worst] + MAX_RISE[worst]
        return f"joint {worst + 1} takes {rise:.1f} A more than expected: something resists it"


def _nearer_zero(a: float, b: float) -> float:
    """Return the smaller of two deviations, 0 where they have changed sides."""
    return 0.0 if a * b < 0.0 else min(a, b, key=abs)
