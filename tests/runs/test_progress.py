"""A bar for people: after a second, on a terminal, and nowhere else."""

import io
from collections.abc import Callable
from pathlib import Path

import pytest

from coneskin.core.progress import Progress, ProgressBar
from coneskin.runs.cut import cut_run
from coneskin.runs.decisions import decide_again
from coneskin.runs.export.export import export_run
from coneskin.runs.replay.run import Run
from coneskin.runs.run_files import summarise_run
from coneskin.runs.what_if.what_if import judge_runs, what_if
from tests.runs.conftest import COLLISION

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


@pytest.mark.long
@pytest.mark.parametrize("work", WORK)
def test_progress_is_told_from_the_first_seconds_of_a_run_to_its_end(work: str, collision: Run, tmp_path: Path) -> None:
    told: list[float] = []
    WORK[work](collision, tmp_path, told.append)
    assert told == sorted(told)
    assert told[0] < 0.6
    assert told[-1] == 1.0


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def drawn(stream: io.StringIO, *steps: tuple[float, float]) -> str:
    now = [0.0]
    bar = ProgressBar("9 runs", stream, lambda: now[0])
    for time, fraction in steps:
        now[0] = time
        bar(fraction)
    return stream.getvalue()


def test_it_is_quiet_for_a_second_and_off_a_terminal() -> None:
    assert drawn(Terminal(), (0.5, 0.5), (0.9, 1.0)) == ""
    assert drawn(io.StringIO(), (5.0, 0.5), (9.0, 1.0)) == ""


def test_it_tells_what_is_left_and_ends_with_a_line() -> None:
    out = drawn(Terminal(), (2.0, 0.25), (2.05, 0.26), (8.0, 1.0))
    assert "9 runs [########......................]  25%, 6 s left" in out
    assert out.count("\r") == 2  # one came too soon after the other
    assert out.endswith("100%, 0 s left  \n")
