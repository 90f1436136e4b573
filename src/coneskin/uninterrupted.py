"""A job that Ctrl-C does not abort half way."""

from __future__ import annotations

import threading
from collections.abc import Callable

__all__ = ["uninterrupted"]


def uninterrupted(job: Callable[[], None]) -> None:
    """Do a job to its end; it must have one.

    Raises:
        KeyboardInterrupt: a person, or SIGTERM, has interrupted meanwhile; the job is done nevertheless.
        BaseException: what the job has raised.
    """
    raised: list[BaseException] = []

    def do() -> None:
        try:
            job()
        except BaseException as exc:
            raised.append(exc)

    thread = threading.Thread(target=do, name="coneskin closing")  # an interrupt is raised in the main thread only
    thread.start()
    interrupt: KeyboardInterrupt | None = None
    while thread.is_alive():
        try:
            thread.join()
        except KeyboardInterrupt as exc:
            interrupt = exc
    for error in (*raised, interrupt):
        if error is not None:
            raise error
