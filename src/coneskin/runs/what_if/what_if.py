"""What if: what today's code, or other parameters, would have made of runs that were recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.journal import EventName
from coneskin.runs.block_progress import Progress, silent
from coneskin.runs.comparison import Comparison, compare_decisions
from coneskin.runs.decisions import Decisions, decide_again, recorded_decisions
from coneskin.runs.replay.quantities import Tolerances
from coneskin.runs.replay.run import read_run
from coneskin.runs.run_files import run_name

from .detection_score import score_detection
from .touch_labels import TouchLabel, label_path, read_labels, recorded_labels, true_touches

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Run

__all__ = ["AS_RECORDED", "broken_rows", "judge_run", "variant_name", "what_if"]

_SEEN = 0.1  # s that a touch may take to be seen: one that begins later before the end of a run is none of it
AS_RECORDED = "as recorded"  #: name of the variant without other settings


def what_if(
    run: Run, settings: Mapping[str, Any], tolerances: Tolerances | None = None, progress: Progress = silent
) -> Comparison:
    """Compare what today's guard makes of a run with what it makes of it with other settings.

    Args:
        run: the recorded run.
        settings: such as ``{"reaction.kind": "stop", "detection.touch_level": 0.08}``.
        tolerances: what does not count.
        progress: called now and then with the fraction that is done.

    Raises:
        SceneError: with these settings the scene is none.
    """
    before = decide_again(run, label="today's code", progress=lambda done: progress(0.5 * done))
    after = decide_again(run, settings, progress=lambda done: progress(0.5 + 0.5 * done))
    return compare_decisions(before, after, tolerances)


def variant_name(settings: Mapping[str, Any]) -> str:
    """Return the name of a variant: its settings in words."""
    return ", ".join(f"{name}={value}" for name, value in settings.items()) or AS_RECORDED


def judge_run(
    path: Path, variants: Sequence[Mapping[str, Any]] = ({},), progress: Progress = silent
) -> list[dict[str, Any]]:
    """Replay a run with each variant of its settings and return a row for each; a broken run is a row with its error.

    The columns: run, path, variant, error, complete, same (as recorded, bit by bit but for the last), first_difference,
    contacts, stops, diverged_s, moved_mm, truth ("labels" of a person, what a "virtual skin" was touched with, or the
    contacts that were "recorded"), touches, missed, false_alarms, delay_median_ms, delay_max_ms, duration_s.
    """
    fixed = {"run": run_name(path), "path": str(path)}
    try:
        run = read_run(path)
        recorded = recorded_decisions(run)
        first = last = None
        for block in run.select():
            first, last = block.time if first is None else first, block.time
        span = (0.0, 0.0) if first is None or last is None else (first, last)
        labels, truth = _truth(path, run, recorded, span)
    except ConeSkinError as exc:
        return broken_rows(path, variants, str(exc))
    fixed |= {"truth": truth}
    duration = span[1] - span[0]
    rows = []
    for number, settings in enumerate(variants):
        name = variant_name(settings)

        def tell(done: float, before: int = number) -> None:
            progress((before + done) / len(variants))

        try:
            again = decide_again(run, settings, label=name, progress=tell)
        except ConeSkinError as exc:
            rows.append(_row(**fixed, variant=name, error=str(exc)))
            continue
        facts = _judge(recorded, again, labels)
        rows.append(_row(**fixed, variant=name, complete=run.complete, duration_s=duration, **facts))
    return rows


def broken_rows(path: Path, variants: Sequence[Mapping[str, Any]], why: str) -> list[dict[str, Any]]:
    """Return the rows of a run that cannot be judged, with the reason."""
    return [_row(run=run_name(path), path=str(path), variant=variant_name(one), error=why) for one in variants]


def _truth(path: Path, run: Run, recorded: Decisions, span: tuple[float, float]) -> tuple[list[TouchLabel], str]:
    """Return the touches that there were between two times [s, host clock], and who says so."""
    labels = label_path(path)
    if labels.is_file():
        return read_labels(labels), "labels"
    touches = true_touches(run)
    if touches is None:
        return recorded_labels(recorded), "recorded"
    since, until = (time - run.start for time in span)
    return [touch for touch in touches if touch.end > since and touch.start < until - _SEEN], "virtual skin"


def _judge(recorded: Decisions, again: Decisions, labels: Sequence[TouchLabel]) -> dict[str, Any]:
    comparison = compare_decisions(recorded, again)
    score = score_detection(again, labels)
    median = score.median_delay
    return {
        "same": comparison.same,
        "first_difference": str(comparison.differences[0]) if comparison.differences else None,
        "contacts": sum(event.name == EventName.CONTACT for event in again.events),
        "stops": sum(event.name == EventName.STOPPING for event in again.events),
        "diverged_s": comparison.diverged,
        "moved_mm": 1e3 * comparison.farthest,
        "touches": score.touches,
        "missed": score.missed,
        "false_alarms": score.false_alarms,
        "delay_median_ms": None if median is None else 1e3 * median,
        "delay_max_ms": 1e3 * max(score.delays) if score.delays else None,
    }


_COLUMNS = (
    *("run", "path", "variant", "error", "complete", "same", "first_difference", "contacts", "stops", "diverged_s"),
    *("moved_mm", "truth", "touches", "missed", "false_alarms", "delay_median_ms", "delay_max_ms", "duration_s"),
)


def _row(**values: Any) -> dict[str, Any]:
    assert not values.keys() - set(_COLUMNS)
    return {name: values.get(name) for name in _COLUMNS}
