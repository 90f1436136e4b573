"""The benches start: each row of the table is a module with a main and a first line that says what it measures."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.paths import ROOT

#: imports every bench; what is not installed may be missing
IMPORT_ALL = """
import importlib
from bench.table import BENCHES
for name, module in BENCHES.items():
    try:
        assert callable(importlib.import_module(module).main), name
    except ModuleNotFoundError as error:
        assert not error.name.startswith(("bench", "coneskin", "tests")), (name, error)
"""


def list_of_benches() -> dict[str, str]:
    """Return what `python -m bench` prints: name -> line."""
    done = subprocess.run([sys.executable, "-m", "bench"], cwd=ROOT, capture_output=True, text=True, check=True)
    return dict(line.split(maxsplit=1) for line in done.stdout.splitlines())


def test_the_runner_lists_each_bench_with_a_line() -> None:
    benches = list_of_benches()
    assert len(benches) > 30
    assert all(line.endswith((".", "?")) for line in benches.values()), benches


def test_an_unknown_bench_is_answered_with_those_there_are() -> None:
    done = subprocess.run([sys.executable, "-m", "bench", "nonsense"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 1
    assert "'nonsense'" in done.stderr
    assert "endurance" in done.stdout


@pytest.mark.long
def test_each_bench_can_be_imported_and_has_a_main() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
