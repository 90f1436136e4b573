"""Lines typed at the terminal, read by a thread so that nothing waits for them on any system."""

from __future__ import annotations

import queue
import sys
import threading

__all__ = ["typed_lines"]


def typed_lines() -> queue.SimpleQueue[str]:
    """Start to read the standard input; return the queue that each of its lines comes to."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin or ():
            lines.put(line)

    threading.Thread(target=read, name="coneskin terminal", daemon=True).start()
    return lines
