"""A job that Ctrl-C does not abort half way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable

__all__ = ["uninterrupted"]


def uninterrupted(job: Callable[[], None]) -> None:
    """Do a job to its end; it must have one.

    Raises:
        KeyboardInterrupt: a person, or SIGTERM, has interrupted meanwhile; the job is done nevertheless.
    """
    noted: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():  # nowhere else an interrupt is raised, or can be caught
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(handler := signal.getsignal(number)):  # what the system does by default is not ours
                before[number] = handler
                signal.signal(number, lambda number, _: noted.append(number))
    try:
        job()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if noted:
        raise KeyboardInterrupt
