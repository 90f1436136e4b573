"""Viewer for the page's benches: takes all that is sent, as a browser does, and draws nothing.

    python -m bench view-viewer http://127.0.0.1:18300 --viewers 10

As a program it looks until it is ended, and gives way to everything else, as if it were on another computer.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import threading
import time
from pathlib import Path
from typing import Any


class Viewer:
    """Viewer that takes all that is sent, as a browser does, and draws nothing.

    Attributes:
        touched: when the words came that the arm stops [s, monotonic]; None until then.
        messages: that came.
        active: the newest words are that the guard is active.
        pictures: parcels in which a link has turned.
        waited: how long the page's process had got no processor when the words came [s].
    """

    def __init__(self, url: str, pid: int) -> None:
        self.touched: float | None = None
        self.messages, self.pictures, self.waited, self.active = 0, 0, 0.0, False
        self._pid = pid
        self._url, self._over = url, threading.Event()
        self._thread = threading.Thread(target=self._view, daemon=True)
        self._thread.start()

    def _view(self) -> None:
        import viser
        import zstandard
        from websockets.exceptions import ConnectionClosed
        from websockets.sync.client import connect

        protocol: Any = f"viser-v{viser.__version__}"
        with (
            contextlib.suppress(ConnectionClosed),  # the page has ended
            connect(self._url.replace("http", "ws"), subprotocols=[protocol], max_size=None) as socket,
        ):
            while not self._over.is_set():
                data = socket.recv()
                came = time.monotonic()
                assert isinstance(data, bytes)
                size, packed = (int.from_bytes(data[at : at + 8], "little") for at in (0, 8))
                inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
                self.messages += 1
                self.pictures += b"SetOrientationMessage" in inner
                if b"coneskin-phase" in inner:
                    self.active = b">active<" in inner
                    if self.touched is None and (b">stopping<" in inner or b">latched" in inner):
                        self.touched, self.waited = came, waited(self._pid)

    def end(self) -> None:
        """Leave."""
        self._over.set()

    def join(self) -> None:
        """Wait until it has left, or the page has ended."""
        self._thread.join()


def processor_time(pid: int) -> float:
    """Time that a process has run [s]."""
    return sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13])) / os.sysconf(
        "SC_CLK_TCK"
    )


def waited(pid: int) -> float:
    """How long the threads of a process were ready and got no processor, together [s]."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return 1e-9 * sum(int((task / "schedstat").read_text().split()[1]) for task in tasks)


def main() -> None:
    """Look at a page until this process is ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("--viewers", type=int, default=1)
    args = parser.parse_args()
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    if os.getsid(0) == os.getpid():
        Path("/proc/self/autogroup").write_text("19")
    viewers = [Viewer(args.url, os.getpid()) for _ in range(args.viewers)]
    for one in viewers:
        one.join()


if __name__ == "__main__":
    main()
