"""Time slice of a process, told by the kernel's own file."""

import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from coneskin.core import child_process
from coneskin.core.child_process import shorten_time_slice

OWN = Path("/proc/thread-self/sched")
told_by_kernel = pytest.mark.skipif(
    not OWN.exists() or "se.slice" not in OWN.read_text(),
    reason="this kernel does not tell time slices: Linux from 6.12 on with SCHED_DEBUG does",
)

_PROGRAM = """
import os, subprocess, threading
from pathlib import Path
from coneskin.core.child_process import shorten_time_slice
tell = lambda: print(Path("/proc/thread-self/sched").read_text().partition("se.slice")[2].split()[1])
os.nice(3)
tell()
shorten_time_slice()
tell()
thread = threading.Thread(target=tell)
thread.start()
thread.join()
print(os.nice(0) + 100 * os.sched_getscheduler(0), flush=True)
subprocess.run(["grep", "se.slice", "/proc/self/sched"])
"""


@told_by_kernel
def test_a_process_its_later_threads_and_its_children_have_short_ones_and_the_nice_value_as_before() -> None:
    done = subprocess.run([sys.executable, "-c", _PROGRAM], capture_output=True, text=True, timeout=60, check=True)
    before, own, thread, nice, child = (int(line.split()[-1]) for line in done.stdout.splitlines())
    assert own == thread == child == 100_000 < before
    assert nice == min(os.nice(0) + 3, 19)  # 19 is the largest there is


@told_by_kernel
def test_a_thread_with_a_policy_of_its_own_keeps_it() -> None:
    told: list[object] = []

    def run() -> None:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
        shorten_time_slice()
        told.extend((os.sched_getscheduler(0), re.search(r"se\.slice *: *100000$", OWN.read_text(), re.MULTILINE)))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert told == [os.SCHED_BATCH, None]


def test_on_a_machine_whose_calls_are_not_known_nothing_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child_process, "_CALL_NUMBERS", {})
    monkeypatch.setattr("ctypes.CDLL", None)
    shorten_time_slice()
