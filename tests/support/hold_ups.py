"""Hold-ups of this computer, seen by a process that wants to run every few milliseconds, until it is closed."""

from __future__ import annotations

import os
import subprocess
import sys
import time

_WATCH = """
import sys, time
last = time.monotonic()
print(last, 0, flush=True)
while True:
    time.sleep(.005)
    now = time.monotonic()
    if now - last > .01:
        print(now, now - last, flush=True)
    last = now
"""


class HoldUpWatch:
    """Process that notes when it was not let run for 10 ms, from its start until ``close``."""

    def __init__(self) -> None:
        self.process = subprocess.Popen([sys.executable, "-c", _WATCH], stdout=subprocess.PIPE)
        assert self.process.stdout is not None
        self._pipe = self.process.stdout.fileno()
        self._read = os.read(self._pipe, 1)  # it runs
        os.set_blocking(self._pipe, False)

    def longest_since(self, began: float) -> float:
        """Return the longest hold-up that ended after a time of ``time.monotonic`` [s]; 0 where there was none.

        A hold-up that still lasts is seen too: for as long as the watch itself has not been let run.
        """
        end = time.monotonic()
        time.sleep(0.02)  # where the watch is held up now, it has said so when it ran again
        try:
            while more := os.read(self._pipe, 65536):
                self._read += more
        except BlockingIOError:
            pass
        lines, _, self._read = self._read.rpartition(b"\n")
        seen = [tuple(map(float, line.split())) for line in lines.splitlines()]
        return max((late for at, late in seen if began < at <= end + 1.0), default=0.0)

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()
