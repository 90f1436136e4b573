"""What the system says of another process: suspended by a signal, waiting for a processor, or neither."""

import os
import signal
import subprocess
import sys
import time

import pytest

from coneskin.core.process_watch import ProcessWatch, load

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells")


def until(what):
    end = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < end


@pytest.mark.promise("P50")
def test_a_process_is_suspended_while_a_signal_has_stopped_it_and_one_that_holds_its_lock_is_not():
    code = "print(1, flush=True); sorted([0.5] * 3_000_000); import sys; sys.stdin.read()"
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert child.stdout.readline() == b"1\n"
        watch = ProcessWatch(child.pid)
        assert not watch.suspended()
        child.send_signal(signal.SIGSTOP)
        until(watch.suspended)
        child.send_signal(signal.SIGCONT)
        until(lambda: not watch.suspended())
    finally:
        child.kill()
        child.communicate()
    assert not watch.suspended()  # it has ended, which its channel tells
    assert not watch.waits(1.0)


def threads(folder, **facts):
    """A process with these threads: number -> state, and processor time [ns]."""
    for number, (state, ran) in facts.items():
        task = folder / "7" / "task" / number.strip("t")
        task.mkdir(parents=True, exist_ok=True)
        (task / "stat").write_text(f"{number} (a ) R name) {state} 1 2 3\n")
        (task / "schedstat").write_text(f"{ran} 5 6\n")


@pytest.mark.parametrize(
    ("state", "ran", "waits"),
    [("R", 1_000, True), ("D", 0, True), ("S", 0, False), ("T", 0, False), ("R", 25_000_000, False)],
    ids=["runnable", "waits for the disk", "sleeps", "stopped", "has run"],
)
def test_a_thread_waits_for_a_processor_where_it_may_run_and_does_not(tmp_path, state, ran, waits):
    watch = ProcessWatch(7, tmp_path)
    assert not watch.waits(1.0)  # there is no such process
    threads(tmp_path, t1=("S", 0), t2=(state, 0))
    assert not watch.waits(2.0)
    threads(tmp_path, t2=(state, ran))
    assert watch.waits(2.03) is waits


def test_the_load_is_named_with_the_cores():
    assert f"{os.cpu_count()} cores" in load()
