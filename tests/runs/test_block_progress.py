"""Whatever goes through a long run says how far it is."""

from collections.abc import Callable
from pathlib import Path

import pytest

from coneskin.runs.block_progress import Progress
from coneskin.runs.cut import cut_run
from coneskin.runs.decisions import decide_again
from coneskin.runs.export.export import export_run
from coneskin.runs.replay.run import Run
from coneskin.runs.run_summary import summarise_run
from coneskin.runs.what_if.batch import judge_runs
from coneskin.runs.what_if.what_if import what_if

from .conftest import COLLISION

WORK: dict[str, Callable[[Run, Path, Progress], object]] = {
    "replay": lambda run, _, tell: decide_again(run, progress=tell),
    "what if": lambda run, _, tell: what_if(run, {"reaction.kind": "stop"}, progress=tell),
    "one run, two variants": lambda _, __, tell: judge_runs(
        [COLLISION], [{}, {"reaction.kind": "stop"}], progress=tell
    ),
    "summary": lambda run, _, tell: summarise_run(COLLISION, run, tell),
    "cut": lambda run, folder, tell: cut_run(run, folder / "cut.rec", 2.95, progress=tell),
    "csv": lambda run, folder, tell: export_run(run, folder / "csv", "csv", tell),
}


@pytest.mark.parametrize("work", WORK)
def test_progress_is_told_from_the_first_seconds_of_a_run_to_its_end(work: str, collision: Run, tmp_path: Path) -> None:
    told: list[float] = []
    WORK[work](collision, tmp_path, told.append)
    assert told == sorted(told)
    assert told[0] < 0.6
    assert told[-1] == 1.0
