"""Signals that end a long command: it removes what it has half written, and a library cannot swallow them."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["ending_signals"]

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def ending_signals() -> Iterator[Callable[[], None]]:
    """Let SIGINT and SIGTERM raise, so that every ``finally`` is run.

    SIGINT raises KeyboardInterrupt, SIGTERM SystemExit with the exit code 143. Some libraries catch every exception
    where they are imported or called back: the exception is raised again by what is yielded, and at the end.

    Yields:
        a function that raises if a signal has come, to be called between the steps of the command.
    """
    came: list[int] = []

    def look() -> None:
        if came:
            raise KeyboardInterrupt if came[0] == signal.SIGINT else SystemExit(128 + came[0])

    def take(number: int, _: FrameType | None) -> None:
        came.append(number)
        look()

    if threading.current_thread() is not threading.main_thread():  # others cannot set handlers
        yield look
        return
    before = [(number, signal.signal(number, take)) for number in _SIGNALS]
    try:
        yield look
    except Exception:
        look()  # what a library made of the signal is not the reason
        raise
    finally:
        for number, handler in before:
            signal.signal(number, handler)
