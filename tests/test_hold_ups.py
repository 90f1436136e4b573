"""A test with real processes runs again where this computer held it up, and only there."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.support.paths import ROOT

from .support.hold_ups import HoldUpWatch

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="it suspends a process by a signal")

_CONFTEST = """
from tests.conftest import pytest_runtest_protocol, pytest_terminal_summary
"""
_TESTS = """
import os, signal, time
import pytest
from tests.conftest import _WATCH

pytestmark = pytest.mark.processes
tries = {"held": 0, "always": 0}

@pytest.fixture
def as_new():
    return []

def hold_up(config):
    watch = config.stash[_WATCH].process.pid
    os.kill(watch, signal.SIGSTOP)
    time.sleep(.1)
    os.kill(watch, signal.SIGCONT)

def test_held_up_once(as_new, pytestconfig):
    tries["held"] += 1
    as_new.append(1)
    assert as_new == [1]
    if tries["held"] == 1:
        hold_up(pytestconfig)
        assert not "held up"

def test_held_up_always(pytestconfig):
    tries["always"] += 1
    hold_up(pytestconfig)
    assert not "held up"

def test_counts():
    assert tries == {"held": 2, "always": 5}
"""


def test_a_suspended_watch_reports_for_how_long():
    watch = HoldUpWatch()
    try:
        began = time.monotonic()
        os.kill(watch.process.pid, signal.SIGSTOP)
        time.sleep(0.1)
        os.kill(watch.process.pid, signal.SIGCONT)
        assert watch.longest_since(began) >= 0.09
        assert watch.longest_since(time.monotonic() + 1000.0) == 0.0
    finally:
        watch.close()


def test_what_was_held_up_runs_again_and_what_always_fails_fails(tmp_path):
    (tmp_path / "conftest.py").write_text(_CONFTEST)
    (tmp_path / "test_it.py").write_text(_TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = processes\n")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(tmp_path),
        str(tmp_path),
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=120)
    assert "1 failed, 2 passed" in done.stdout, done.stdout + done.stderr
    assert done.stdout.count("held up, so run again: test_it.py::test_held_up_once") == 1
    assert done.stdout.count("held up, so run again: test_it.py::test_held_up_always") == 4
