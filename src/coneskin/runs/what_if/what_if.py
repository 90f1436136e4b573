"""What if: what today's code, or other parameters, would have made of runs that were recorded, one or many.

A score counts touches missed, false alarms and delays. The true touches are those that a person labeled, those that a
virtual skin was given, or, without either, the recorded ones. Many runs are judged in a pool of processes, or on a Dask
cluster; a run that breaks is a row, and the rest goes on.
"""

from __future__ import annotations

import concurrent.futures
import math
import multiprocessing
import os
import socket
import statistics
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.core.errors import ConeSkinError, RecordingError, needed_package
from coneskin.core.files import read_file
from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import is_time
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import BlockKind, EventName, contact_force
from coneskin.runs.comparison import Comparison, compare_decisions
from coneskin.runs.decisions import Decisions, decide_again, recorded_decisions
from coneskin.runs.replay.event_details import Tolerances
from coneskin.runs.replay.run import Run, read_run
from coneskin.runs.run_files import run_name

_MAX_SIZE = 1 << 24  # bytes
_TRUTH_KINDS = frozenset({BlockKind.TRUTH})
_TRUTH_FIELDS = {"touches", "pressed", "released"}  # of what touched the skin
_EARLY_TIME = 0.25  # s before a recorded contact in which a more sensitive guard may see the same touch


class _TouchLabel(NamedTuple):
    """One touch that there was."""

    start: float  #: when it begins [s since the start of the run]
    end: float  #: when it is over
    sensor: str = ""  #: name of the touched sensor; empty for any
    early: float = 0.0  #: how long before the start a contact still counts as this touch [s]


def _read_labels(path: Path) -> list[_TouchLabel]:
    """Return the touches in a TOML file: ``[[touch]]`` with ``start_s``, ``end_s`` and, if wanted, ``sensor``."""
    try:
        tables = tomllib.loads(read_file(path, _MAX_SIZE).decode("utf-8-sig")).get("touch", [])
        labels = [_TouchLabel(item["start_s"], item["end_s"], str(item.get("sensor", ""))) for item in tables]
    except OSError as exc:
        raise RecordingError(f"cannot read the labels {path}: {exc.strerror or exc}") from exc
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as exc:
        raise RecordingError(f"{path} has no [[touch]] with start_s and end_s: {type(exc).__name__}: {exc}") from exc
    for label in labels:
        if not (is_time(label.start) and is_time(label.end) and label.start < label.end):
            raise RecordingError(f"{path}: start_s must be before end_s, got {label.start!r} s and {label.end!r} s")
    return sorted(labels)


def _true_touches(run: Run) -> list[_TouchLabel] | None:
    """Return with what the virtual skin of a run was touched, by a script or by bodies; None where nothing tells."""
    told = [block for block in run.select(kinds=_TRUTH_KINDS) if contact_force(block.payload) is None]
    if not told:
        return None
    labels: list[_TouchLabel] = []
    by_bodies: dict[tuple[str, float], _TouchLabel] = {}  # each told as it begins, and again once it is over
    for block in told:
        try:
            facts = read_json(block.payload)
            if not _TRUTH_FIELDS & facts.keys():
                raise ValueError(f"none of {', '.join(sorted(_TRUTH_FIELDS))} in it")
            labels += [_label(touch, run.start) for touch in facts.get("touches", ())]
            for one in (_label(touch, run.start) for touch in facts.get("pressed", ())):
                by_bodies[one.sensor, one.start] = one
            if "released" in facts:  # all that touches at that moment
                if not is_time(facts["released"]):
                    raise ValueError(f"released at {facts['released']} s")
                time = facts["released"] - run.start
                labels = [one._replace(end=time) if one.start < time < one.end else one for one in labels]
        except (ValueError, TypeError, KeyError, AttributeError) as exc:
            raise RecordingError(f"a block of {block.time:.6f} s does not say what touched the skin: {exc}") from exc
    return sorted([*labels, *by_bodies.values()])


def _label(touch: dict[str, Any], began: float) -> _TouchLabel:
    start, end = touch["start"], math.inf if touch["end"] is None else touch["end"]
    if not (is_time(start) and isinstance(end, int | float) and start <= end):
        raise ValueError(f"a touch from {start} to {end} s")
    return _TouchLabel(start - began, end - began, str(touch["sensor"]))


def _recorded_labels(recorded: Decisions) -> list[_TouchLabel]:
    """Return the contacts that the guard saw when the run was recorded, as if they were all that there was."""
    labels: list[_TouchLabel] = []
    open_since: dict[str, float] = {}
    for event in recorded.events:
        sensor, time = str(event.details.get("sensor", "")), event.time - recorded.start
        if event.name == EventName.CONTACT:
            open_since.setdefault(sensor, time)
        elif event.name == EventName.TOUCH_ENDED and sensor in open_since:
            labels.append(_TouchLabel(open_since.pop(sensor), time, sensor, _EARLY_TIME))
    labels += [_TouchLabel(start, math.inf, sensor, _EARLY_TIME) for sensor, start in open_since.items()]
    return sorted(labels)


_LATE_TIME = 0.1  # s after the end of a touch in which the skin still relaxes
_SEEING_TIME = 0.1  # s that a touch may take to be seen: one that begins later before the end is not missed


def _score_detection(
    decisions: Decisions, labels: Sequence[_TouchLabel], until: float = math.inf
) -> tuple[int, int, list[float]]:
    """Return how many touches there were, the contacts without one, and the delay of each touch that was seen [s].

    A contact belongs to the touch of its sensor in whose time it begins; a second one in the same touch is no false
    alarm. A delay is negative where the touch was seen before it began. A touch that begins where inputs are missing
    is left out.
    """
    known = min(decisions.until, until) - decisions.start
    counted = [label for label in labels if label.start < known]
    first: dict[_TouchLabel, float] = {}
    false_alarms = 0
    for event in decisions.events:
        if event.name != EventName.CONTACT:
            continue
        time, sensor = event.time - decisions.start, str(event.details.get("sensor", ""))
        own = [
            label
            for label in counted
            if label.sensor in ("", sensor) and label.start - label.early <= time <= label.end + _LATE_TIME
        ]
        if own:
            first.setdefault(min(own, key=lambda one: abs(one.start - time)), time)
        else:
            false_alarms += 1
    touches = sum(label in first or label.start < known - _SEEING_TIME for label in counted)
    return touches, false_alarms, [time - label.start for label, time in first.items()]


AS_RECORDED = "as recorded"  #: name of the variant without other settings


def what_if(
    run: Run, settings: Mapping[str, Any], tolerances: Tolerances | None = None, progress: Progress = silent
) -> Comparison:
    """Compare what today's guard makes of a run with what it makes of it with other settings.

    Args:
        settings: such as ``{"reaction.kind": "stop", "detection.touch_level": 0.08}``.

    Raises:
        SceneError: with these settings the scene is none.
    """
    before = decide_again(run, label="today's code", progress=lambda done: progress(0.5 * done))
    after = decide_again(run, settings, progress=lambda done: progress(0.5 + 0.5 * done))
    return compare_decisions(before, after, tolerances)


Rows = list[dict[str, Any]]
_Judge = Callable[..., Rows]  # as ``_judge_run``
_Variants = Sequence[Mapping[str, Any]]


def _variant_name(settings: Mapping[str, Any]) -> str:
    """Return the name of a variant: its settings in words."""
    return ", ".join(f"{name}={value}" for name, value in settings.items()) or AS_RECORDED


def _judge_run(path: Path, variants: _Variants = ({},), progress: Progress = silent) -> Rows:
    """Replay a run with each variant of its settings and return a row for each; a broken run is a row with its error.

    The columns: run, path, variant, error, complete, same (as recorded, bit by bit but for the last), first_difference,
    contacts, stops, diverged_s, moved_mm, truth ("labels" of a person, what a "virtual skin" was touched with, or the
    contacts that were "recorded"), touches, missed, false_alarms, unlabeled (contacts beyond the recorded ones where
    these are the truth: no one knows whether they are false alarms), delay_median_ms, delay_max_ms, duration_s.
    """
    fixed = {"run": run_name(path), "path": str(path)}
    try:
        run = read_run(path)
        recorded = recorded_decisions(run)
        labels, truth = _truth(path, run, recorded)
    except ConeSkinError as exc:
        return _broken_rows(path, variants, str(exc))
    fixed |= {"truth": truth}
    duration = run.span[1] - run.span[0]
    rows = []
    for number, settings in enumerate(variants):
        name = _variant_name(settings)

        def tell(done: float, before: int = number) -> None:
            progress((before + done) / len(variants))

        try:
            again = decide_again(run, settings, label=name, progress=tell)
        except ConeSkinError as exc:
            rows.append(_row(**fixed, variant=name, error=str(exc)))
            continue
        facts = _judge(recorded, again, labels, truth, run.span[1])
        rows.append(_row(**fixed, variant=name, complete=run.complete, duration_s=duration, **facts))
    return rows


def _broken_rows(path: Path, variants: _Variants, why: str) -> Rows:
    """Return the rows of a run that cannot be judged, with the reason."""
    return [_row(run=run_name(path), path=str(path), variant=_variant_name(one), error=why) for one in variants]


def _truth(path: Path, run: Run, recorded: Decisions) -> tuple[list[_TouchLabel], str]:
    """Return the touches that there were in the time of a run, and who says so."""
    labels = path.with_suffix(".touches.toml")
    if labels.is_file():
        return _read_labels(labels), "labels"
    touches = _true_touches(run)
    if touches is None:
        return _recorded_labels(recorded), "recorded"
    since = run.span[0] - run.start
    return [touch for touch in touches if touch.end > since], "virtual skin"


def _judge(
    recorded: Decisions, again: Decisions, labels: Sequence[_TouchLabel], truth: str, until: float = math.inf
) -> dict[str, Any]:
    comparison = compare_decisions(recorded, again)
    touches, false_alarms, delays = _score_detection(again, labels, until)
    known = truth != "recorded"
    return {
        "same": comparison.same,
        "first_difference": str(comparison.differences[0]) if comparison.differences else None,
        "contacts": sum(event.name == EventName.CONTACT for event in again.events),
        "stops": sum(event.name == EventName.STOPPING for event in again.events),
        "diverged_s": comparison.diverged,
        "moved_mm": 1e3 * comparison.farthest,
        "touches": touches,
        "missed": touches - len(delays),
        "false_alarms": false_alarms if known else 0,
        "unlabeled": 0 if known else false_alarms,
        "delay_median_ms": 1e3 * statistics.median(delays) if delays else None,
        "delay_max_ms": 1e3 * max(delays) if delays else None,
    }


_TABLE_COLUMNS = (
    *("run", "path", "variant", "error", "complete", "same", "first_difference", "contacts", "stops", "diverged_s"),
    *("moved_mm", "truth", "touches", "missed", "false_alarms", "unlabeled", "delay_median_ms", "delay_max_ms"),
    "duration_s",
)


def _row(**values: Any) -> dict[str, Any]:
    assert not values.keys() - set(_TABLE_COLUMNS)
    return {name: values.get(name) for name in _TABLE_COLUMNS}


_CONNECT_TIMEOUT = 5.0  # s


def _judge_on_cluster(
    address: str, paths: Sequence[Path], variants: _Variants, judge: _Judge
) -> Iterator[tuple[Path, Rows]]:
    """Yield each run with its rows, as the workers finish them. One on which a worker dies three times is an error."""
    with needed_package("distributed", "a Dask cluster", "dask"):
        from distributed import Client, as_completed
        from distributed.comm.addressing import parse_address, parse_host_port
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
                yield path, _broken_rows(path, variants, f"{future.status}: {future.exception()}")


def judge_runs(
    paths: Sequence[Path],
    variants: Sequence[Mapping[str, Any]] = ({},),
    *,
    jobs: int | None = None,
    scheduler: str = "",
    progress: Progress = silent,
    judge: _Judge = _judge_run,
) -> Rows:
    """Judge runs, each with each variant of its settings.

    Args:
        variants: settings; ``{}`` for those of the run.
        jobs: processes; by default one for each core. 1: this process.
        scheduler: address of a Dask scheduler, such as "tcp://10.0.0.5:8786", whose workers see the same paths.

    Returns:
        a row for each run and variant, in the order of the runs; see ``_judge_run``.

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
            with _pool(1) as pool:
                try:
                    rows = _rows_of(pool.submit(judge, path, variants), path, variants)
                except BrokenProcessPool:
                    rows = _broken_rows(path, variants, "its process was killed: out of memory?")
            yield path, rows


def _pool(jobs: int) -> concurrent.futures.ProcessPoolExecutor:
    return concurrent.futures.ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))


def _rows_of(future: concurrent.futures.Future[Rows], path: Path, variants: _Variants) -> Rows:
    try:
        return future.result()
    except BrokenProcessPool:
        raise
    except Exception as exc:  # a mistake of ours in one run must not cost the others
        return _broken_rows(path, variants, f"{type(exc).__name__}: {exc}")
