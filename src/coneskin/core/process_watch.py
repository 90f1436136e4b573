"""Watch over another process from outside, by what the system says of it: suspended, or waiting for a processor.

A process that hangs and one that this computer holds up send no sign of life alike. Linux tells them apart: what waits
for a processor is runnable, and its processor time stands still (``/proc/PID/task/TID``, ``stat`` and ``schedstat``,
proc(5)). Other systems say nothing of that kind, and there nothing is known.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

_STAT_BYTES: Final = 400
_MAX_SHARE: Final = 0.2  # of the time between two looks; a thread that has run for less was waiting


class ProcessWatch:
    """Watch over one process, by its number in the folder where the system tells of processes."""

    def __init__(self, pid: int, folder: Path = Path("/proc")) -> None:
        self._folder = folder / str(pid)
        try:  # while it is open the number belongs to no other process
            self._stat = os.open(self._folder / "stat", os.O_RDONLY | os.O_CLOEXEC)
        except OSError:
            self._stat = -1
        self._ran: dict[str, float] = {}  # thread that was runnable -> its processor time then [s]
        self._looked_at = 0.0

    def suspended(self) -> bool:
        """Tell whether it is stopped by a signal or a debugger."""
        try:
            return _letter(os.pread(self._stat, _STAT_BYTES, 0).decode("ascii", "replace")) in ("T", "t")
        except OSError:  # it has just ended, or this system does not tell
            return False

    def waits(self, now: float) -> bool:
        """Tell whether a thread of it has waited for a processor or the disk since the last look, at times [s]."""
        before, self._ran = self._ran, {}
        since, self._looked_at = self._looked_at, now
        try:
            for task in (self._folder / "task").iterdir():
                if _letter((task / "stat").read_text()) in ("R", "D"):
                    self._ran[task.name] = 1e-9 * int((task / "schedstat").read_text().split()[0])
        except (OSError, ValueError, IndexError):  # it has just ended, or this system does not tell
            return False
        most = _MAX_SHARE * (now - since)
        return any(task in before and ran - before[task] <= most for task, ran in self._ran.items())


def _letter(stat: str) -> str:
    """Return the state in a line of ``stat``: what follows the name, which may hold anything."""
    return stat.rpartition(")")[2].strip()[:1]


def load() -> str:
    """Return how busy this computer is, in words."""
    cores = os.cpu_count() or 1
    return f"load {os.getloadavg()[0]:.1f} on {cores} cores" if hasattr(os, "getloadavg") else f"{cores} cores"
