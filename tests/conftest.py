"""What every test leaves behind: no thread of ours, no child process."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

_TASKS = Path("/proc/self/task")  # Linux; elsewhere only threads are looked at


def _children() -> frozenset[str]:
    """Processes that any thread of this one has started and nobody has waited for."""
    found: set[str] = set()
    for task in _TASKS.glob("*/children"):
        with suppress(OSError):  # that thread has just ended
            found.update(task.read_text().split())
    return frozenset(found)


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    """Fail the test that leaks a thread or a child process.

    A thread that is about to end has a moment to do so. Threads that libraries keep for good carry no name of ours and
    begin in their pools, which are told by "pool" or "Executor" in the name.
    """
    threads, children = set(threading.enumerate()), _children()
    yield
    for thread in set(threading.enumerate()) - threads:
        if "pool" not in thread.name.lower() and "executor" not in thread.name.lower():
            thread.join(1.0)
            assert not thread.is_alive(), f"the test leaves the thread {thread.name!r}"
    left = _children() - children
    assert not left, f"the test leaves the processes {', '.join(sorted(left))}"
