"""Many runs: how fast they are judged in one process, in two, and on a Dask cluster of two workers.

    python -m bench replay-cluster           24 copies of tests/data/collision.rec

By the clock, so it needs an idle machine. Does not show: a network between the workers, or a file server.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from bench.report import head
from coneskin.runs.what_if.batch import judge_runs

__all__ = ["cluster_rates"]

RUN = Path(__file__).parents[2] / "tests" / "data" / "collision.rec"


def cluster_rates(run: Path, folder: Path, count: int = 24) -> Iterator[str]:
    """Yield how many copies of a run, made in a folder, are judged in a second."""
    from distributed import LocalCluster

    paths = [folder / f"{number}.rec" for number in range(count)]
    for path in paths:
        shutil.copyfile(run, path)
    yield f"{count} runs of {run.stat().st_size / 1e3:.0f} kB, by the clock, starts of processes included:"
    yield f"  one process:       {_rate(paths, lambda: judge_runs(paths, jobs=1)):.2f} runs/s"
    yield f"  two processes:     {_rate(paths, lambda: judge_runs(paths, jobs=2)):.2f} runs/s"
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        rate = _rate(paths, lambda: judge_runs(paths, scheduler=address))
        yield f"  Dask, two workers: {rate:.2f} runs/s, the first of them with the workers' imports"


def _rate(paths: list[Path], work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return len(paths) / (time.perf_counter() - began)


def main() -> None:
    print(head("distributed") + "\n")
    with tempfile.TemporaryDirectory() as folder:
        for line in cluster_rates(RUN, Path(folder)):
            print(line, flush=True)
