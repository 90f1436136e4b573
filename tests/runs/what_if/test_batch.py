"""Many runs: one that is broken, or kills its process, is a row, and the rest goes on; a cluster says the same."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.errors import RecordingError
from coneskin.runs.comparison import comparison_lines
from coneskin.runs.replay.run import Run
from coneskin.runs.what_if.variants import score_variants, variant_lines, write_rows
from coneskin.runs.what_if.what_if import _judge_run, judge_runs, what_if

from ..conftest import COLLISION

DEAF = {"detection.touch_level": 0.9, "detection.location_level": 0.95}
VARIANTS: tuple[dict[str, Any], ...] = ({}, DEAF)


@pytest.fixture(scope="module", autouse=True)
def _tracker() -> None:
    """Start the one process that a pool leaves behind for the next, before leaks are counted."""
    resource_tracker.ensure_running()


@pytest.fixture
def runs(tmp_path: Path) -> list[Path]:
    """Two runs, the second with a touch that a person has labelled a little earlier, and one that is broken."""
    paths = [tmp_path / name for name in ("a.rec", "b.rec", "broken.rec")]
    for path in paths[:2]:
        path.write_bytes(COLLISION.read_bytes())
    paths[2].write_bytes(b"no recording")
    (tmp_path / "b.touches.toml").write_text("[[touch]]\nstart_s = 2.94\nend_s = 3.1\n")
    return paths


def check(rows: Sequence[Mapping[str, Any]]) -> None:
    assert [(row["run"], bool(row["error"])) for row in rows] == [
        *[("a", False)] * 2,
        *[("b", False)] * 2,
        *[("broken", True)] * 2,
    ]
    a, a_deaf, b, b_deaf = rows[:4]
    assert (a["same"], a["truth"], a["touches"], a["missed"], a["false_alarms"]) == (True, "recorded", 1, 0, 0)
    assert a["delay_median_ms"] == pytest.approx(0.0)
    assert (b["truth"], b["delay_median_ms"]) == ("labels", pytest.approx(9.03, abs=0.05))
    assert (a_deaf["missed"], b_deaf["missed"], a_deaf["contacts"]) == (1, 1, 0)
    assert "touch is missing" in a_deaf["first_difference"]


@pytest.mark.long
def test_a_table_over_runs_and_variants(runs: list[Path], tmp_path: Path) -> None:
    rows = judge_runs(runs, VARIANTS, jobs=1)
    check(rows)
    recorded, deaf = score_variants(rows)
    assert recorded[1:7] == (2, 1, 0, 2, 0, 0)
    assert deaf[1:7] == (2, 1, 2, 2, 2, 0)
    assert recorded.delay_max_ms == pytest.approx(9.03, abs=0.05)
    lines = variant_lines([recorded, deaf])
    assert lines[1].startswith("as recorded")
    assert lines[2].split()[-2:] == ["-", "-"]
    pytest.importorskip("pyarrow")
    duckdb = pytest.importorskip("duckdb")
    write_rows(tmp_path / "all.parquet", rows)
    with duckdb.connect() as base:
        query = "select variant, sum(missed), count(error) from read_parquet(?) group by variant order by 2"
        found = base.execute(query, [str(tmp_path / "all.parquet")]).fetchall()
    assert found == [("as recorded", 0, 1), (deaf.variant, 2, 1)]


def killed_by_broken(path: Path, variants: Sequence[Mapping[str, Any]], *_: object) -> list[dict[str, Any]]:
    """As ``_judge_run``, but a broken run kills its process, as the kernel does when memory runs out."""
    if path.stem == "broken":
        os.kill(os.getpid(), signal.SIGKILL)
    return _judge_run(path, variants)


@pytest.mark.long
def test_a_run_that_kills_its_process_does_not_take_the_others_with_it(runs: list[Path]) -> None:
    seen: list[float] = []
    rows = judge_runs([runs[2], *runs[:2]], VARIANTS, jobs=2, progress=seen.append, judge=killed_by_broken)
    check([*rows[2:], *rows[:2]])
    assert rows[0]["error"].startswith("its process was killed")
    assert (len(seen), seen[-1]) == (3, 1.0)


_ON_A_CLUSTER = """
import json, logging, socket, sys
from pathlib import Path

import distributed

from coneskin.core.errors import RecordingError
from coneskin.runs.what_if import what_if
from coneskin.runs.what_if.what_if import judge_runs

if __name__ == "__main__":
    paths, variants = [Path(word) for word in sys.argv[2:]], json.loads(sys.argv[1])
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        rows = judge_runs(paths, variants, scheduler=cluster.scheduler_address)
        what_if._CONNECT_TIMEOUT = 0.5
        mute = socket.create_server(("127.0.0.1", 0))
        said = []
        for address in ("tcp://127.0.0.1:1", "nonsense", f"tcp://127.0.0.1:{mute.getsockname()[1]}", "foo://localhost:1"):
            try:
                judge_runs(paths, variants, scheduler=address)
            except RecordingError as exc:
                said.append(str(exc))
        print(json.dumps([rows, said]))
"""


@pytest.mark.long
def test_a_local_cluster_says_the_same(runs: list[Path], tmp_path: Path) -> None:
    """In a process of its own, because its threads do not end with it."""
    pytest.importorskip("distributed")
    script = tmp_path / "on_a_cluster.py"
    script.write_text(_ON_A_CLUSTER)
    command = [sys.executable, str(script), json.dumps(VARIANTS), *map(str, runs)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows, said = json.loads(done.stdout.splitlines()[-1])
    check(rows)
    assert rows == json.loads(json.dumps(judge_runs(runs, VARIANTS, jobs=1)))
    assert [line.split(" ")[3] for line in said[:2]] == ["tcp://127.0.0.1:1", "nonsense"]
    assert len(said) == 4
    assert all("cannot be reached: " in line and "start `dask scheduler`" in line for line in said)
    assert "timed out" in said[2]


def test_no_jobs_are_refused(runs: list[Path]) -> None:
    with pytest.raises(RecordingError, match="at least 1 job, got 0"):
        judge_runs(runs, jobs=0)


@pytest.mark.long
def test_a_setting_that_cannot_be_is_an_error_of_its_variant_alone(runs: list[Path]) -> None:
    good, bad = judge_runs(runs[:1], ({}, {"reaction.kind": "dance"}))
    assert not good["error"]
    assert "reaction.kind must be one of" in bad["error"]


def test_what_if_in_python(collision: Run) -> None:
    lines = comparison_lines(what_if(collision, {"reaction.kind": "stop"}))
    assert lines[0] == "today's code -> reaction.kind = stop"
    assert lines[1] == "  retreat: missing"
