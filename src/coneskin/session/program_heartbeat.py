"""Program heartbeat: the sign of life of the program that guards, from a thread that does nothing else.

It ends with the program's process, and pauses with it. A thread that keeps Python's lock for long pauses it too.
"""

from __future__ import annotations

import threading

from coneskin.core.channel import Channel
from coneskin.robot.driver.messages import REPORT_PERIOD, Heartbeat

__all__ = ["ProgramHeartbeat"]


class ProgramHeartbeat:
    """Heartbeat of this process on the guard's channel, from ``start`` to ``stop``.

    Args:
        channel: the guard's.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="coneskin heartbeat", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; may be called again."""
        self._stopped.set()

    def _run(self) -> None:
        message = Heartbeat().encode()
        while self._channel.send(message) and not self._stopped.wait(REPORT_PERIOD):
            pass
