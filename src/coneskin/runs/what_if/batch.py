"""Many runs: judged in a pool of processes, or on a Dask cluster; a run that breaks is a row, and the rest goes on."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from coneskin.core.errors import MissingExtra, RecordingError
from coneskin.core.progress import Progress, silent

from .what_if import broken_rows, judge_run

_CONNECT_TIMEOUT = 5.0  # s


Rows = list[dict[str, Any]]
_Judge = Callable[..., Rows]  # as ``judge_run``
_Variants = Sequence[Mapping[str, Any]]


def _judge_on_cluster(
    address: str, paths: Sequence[Path], variants: _Variants, judge: _Judge
) -> Iterator[tuple[Path, Rows]]:
    """Yield each run with its rows, as the workers finish them. One on which a worker dies three times is an error."""
    try:
        from distributed import Client, as_completed
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError as exc:
        raise MissingExtra("distributed", "a Dask cluster", "dask") from exc
    try:
        scheme, place = parse_address(address)
        # where no scheduler answers, a client hangs for minutes
        with socket.create_connection(parse_host_port(place), _CONNECT_TIMEOUT) as line:
            if scheme == "tcp" and not line.recv(1):  # a scheduler speaks first
                raise ConnectionError("the line was closed")
        client = Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, OverflowError) as exc:
        raise RecordingError(
            f"the Dask scheduler {address} cannot be reached: {exc}; start `dask scheduler`, and name the address that "
            "it tells, such as tcp://10.0.0.5:8786"
        ) from exc
    with client:
        futures = {}
        for number, path in enumerate(paths):
            settings = [dict(one) for one in variants]
            futures[client.submit(judge, path.resolve(), settings, pure=False, key=f"run-{number}-{path}")] = path
        for future in as_completed(futures, loop=client.loop):
            path = futures[future]
            if future.status == "finished":
                yield path, future.result()
            else:
                yield path, broken_rows(path, variants, f"{future.status}: {future.exception()}")


def judge_runs(
    paths: Sequence[Path],
    variants: Sequence[Mapping[str, Any]] = ({},),
    *,
    jobs: int | None = None,
    scheduler: str = "",
    progress: Progress = silent,
    judge: _Judge = judge_run,
) -> Rows:
    """Judge runs, each with each variant of its settings.

    Args:
        variants: settings; ``{}`` for those of the run.
        jobs: processes; by default one for each core. 1: this process.
        scheduler: address of a Dask scheduler, such as "tcp://10.0.0.5:8786", whose workers see the same paths.

    Returns:
        a row for each run and variant, in the order of the runs; see ``judge_run``.

    Raises:
        RecordingError: the number of jobs is below 1, or the cluster cannot be reached.
        MissingExtra: a scheduler is named and distributed is not installed.
    """
    count = jobs if jobs is not None else min(len(paths), os.cpu_count() or 1)
    if count < 1 and paths:
        raise RecordingError(f"runs need at least 1 job, got {jobs!r}")
    if scheduler:
        done = _judge_on_cluster(scheduler, paths, variants, judge)
    elif count == 1 or len(paths) <= 1:
        done = _judge_here(paths, variants, judge, progress)
    else:
        done = _judge_in_pool(paths, variants, count, judge)
    rows: dict[Path, Rows] = {}
    for path, found in done:
        rows[path] = found
        progress(len(rows) / len(paths))
    return [row for path in paths for row in rows[path]]


def _judge_here(
    paths: Sequence[Path], variants: _Variants, judge: _Judge, progress: Progress
) -> Iterator[tuple[Path, Rows]]:
    for number, path in enumerate(paths):
        yield path, judge(path, variants, lambda done, before=number: progress((before + done) / len(paths)))


def _judge_in_pool(paths: Sequence[Path], variants: _Variants, jobs: int, judge: _Judge) -> Iterator[tuple[Path, Rows]]:
    left = list(paths)
    try:
        with _pool(jobs) as pool:
            futures = {pool.submit(judge, path, variants): path for path in left}
            for future in concurrent.futures.as_completed(futures):
                path = futures[future]
                rows = _rows_of(future, path, variants)
                left.remove(path)
                yield path, rows
    except BrokenProcessPool:  # one of them has killed its process: find out which, one at a time
        for path in left:
            yield path, _judge_alone(path, variants, judge)


def _judge_alone(path: Path, variants: _Variants, judge: _Judge) -> Rows:
    try:
        with _pool(1) as pool:
            return _rows_of(pool.submit(judge, path, variants), path, variants)
    except BrokenProcessPool:
        return broken_rows(path, variants, "its process was killed: out of memory?")


def _pool(jobs: int) -> concurrent.futures.ProcessPoolExecutor:
    return concurrent.futures.ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))


def _rows_of(future: concurrent.futures.Future[Rows], path: Path, variants: _Variants) -> Rows:
    try:
        return future.result()
    except BrokenProcessPool:
        raise
    except Exception as exc:  # a mistake of ours in one run must not cost the others
        return broken_rows(path, variants, f"{type(exc).__name__}: {exc}")
