"""The benches start: each row of the table is a module with a main and a first line that says what it measures."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

from tests.support.paths import ROOT

#: imports every bench; what is not installed may be missing
IMPORT_ALL = """
import importlib
from bench.table import BENCHES
for name, bench in BENCHES.items():
    try:
        assert callable(importlib.import_module(bench.module).main), name
    except ModuleNotFoundError as error:
        assert not error.name.startswith(("bench", "coneskin", "tests")), (name, error)
"""


def list_of_benches() -> dict[str, str]:
    """Return what `python -m bench` prints: name -> line."""
    done = subprocess.run([sys.executable, "-m", "bench"], cwd=ROOT, capture_output=True, text=True, check=True)
    return dict(line.split(maxsplit=1) for line in done.stdout.split("\n\n")[-1].splitlines())


#: counts what changes in guard, stops and reactions, as they are now
COUNT_STATE = """
from pathlib import Path
from bench.loop.parts import GUARD, changing
print(sum(changing([path.read_text("utf-8") for room in GUARD for path in Path(room).rglob("*.py")])))
"""


def test_a_guard_keeps_a_third_less_state_than_it_had() -> None:
    """156 attributes changed after construction: each is one more to think of."""
    done = subprocess.run([sys.executable, "-c", COUNT_STATE], cwd=ROOT, capture_output=True, text=True, check=True)
    assert 0 < int(done.stdout) <= 104


@pytest.mark.long
def test_the_runner_lists_each_bench_with_a_line() -> None:
    benches = list_of_benches()
    assert len(benches) > 30
    assert all(line.endswith((".", "?")) for line in benches.values()), benches


def test_an_unknown_bench_is_answered_with_those_there_are() -> None:
    done = subprocess.run([sys.executable, "-m", "bench", "nonsense"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2
    assert "'nonsense'" in done.stderr
    assert "endurance" in done.stderr


def test_the_page_of_results_is_what_the_files_make() -> None:
    """After a change of bench/results or of its script: python -m bench page."""
    done = subprocess.run([sys.executable, "-m", "bench", "page", "--check"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len((ROOT / "bench" / "RESULTS.md").read_text(encoding="utf-8").split()) <= 8850


def test_a_result_says_where_it_comes_from_and_what_it_does_not_show() -> None:
    benches = list_of_benches()
    for file in sorted((ROOT / "bench" / "results").glob("*.json")):
        run = json.loads(file.read_text(encoding="utf-8"))
        assert file.name.split(".")[0] == run["bench"]
        assert run["bench"] in benches
        assert run["command"].startswith(f"python -m bench {run['bench']}")
        assert all(run[word] for word in ("commit", "date", "machine", "not_shown")), file.name
        assert run.get("tables") or run.get("printed"), file.name
        for table in run.get("tables", ()):
            assert {len(row) for row in table["rows"]} == {len(table["columns"])}, (file.name, table["title"])


@pytest.mark.long
def test_each_bench_can_be_imported_and_has_a_main() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.promise("P38")
@pytest.mark.long
def test_an_arm_that_gives_way_to_a_firm_push_leads_with_no_bare_wrist() -> None:
    """With 28 N at 18 mm/s, a wall behind the wrist bore up to 20 N before the joints showed it."""
    pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")
    words = [sys.executable, "-m", "bench", "bare-sides", "--case", "2", "--way", "comply"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    (force,) = re.findall(r"forces=\([\d.]+, ([\d.]+)\)", done.stdout)
    assert "no skin covers the wrist 2, which would lead" in done.stdout
    assert float(force) == 0.0
