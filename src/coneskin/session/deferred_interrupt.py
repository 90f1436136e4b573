"""Deferred interrupt: a job that Ctrl-C does not abort half way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable

__all__ = ["defer_interrupts"]


def defer_interrupts(job: Callable[[], None]) -> None:
    """Do a job to its end, and raise an interrupt only then; the job must have an end.

    Raises:
        KeyboardInterrupt: a person, or SIGTERM, has interrupted meanwhile; the job is done nevertheless.
    """
    noted: list[int] = []
    before = {}
    if (
        threading.current_thread() is threading.main_thread()
    ):  # interrupts are raised, and can be caught, in this thread only
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(handler := signal.getsignal(number)):  # the default of the system is left alone
                before[number] = handler
                signal.signal(number, lambda number, _: noted.append(number))
    try:
        job()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if noted:
        raise KeyboardInterrupt
