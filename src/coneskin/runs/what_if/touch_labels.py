"""Touches that there truly were in a run: as labelled, as a virtual skin was touched, or, without that, as recorded."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.core.errors import RecordingError
from coneskin.core.files import read_file
from coneskin.core.recording.block import is_time
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import BlockKind, EventName, contact_force
from coneskin.runs.decisions import Decisions

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Run

__all__ = ["TouchLabel", "label_path", "read_labels", "recorded_labels", "true_touches"]

_MAX_SIZE = 1 << 24  # bytes
_TRUTH = frozenset({BlockKind.TRUTH})
_TELLS = {"touches", "pressed", "released"}  # of what touched the skin
_EARLY = 0.25  # s before a recorded contact in which a more sensitive guard may see the same touch


class TouchLabel(NamedTuple):
    """One touch that there was.

    Attributes:
        start: when it begins [s since the start of the run].
        end: when it is over.
        sensor: name of the touched sensor; empty for any.
        early: how long before the start a contact still counts as this touch [s].
    """

    start: float
    end: float
    sensor: str = ""
    early: float = 0.0


def label_path(recording: Path) -> Path:
    """Return the file of a recording's labels: ``run.touches.toml`` of ``run.rec``."""
    return recording.with_suffix(".touches.toml")


def read_labels(path: Path) -> list[TouchLabel]:
    """Return the touches in a TOML file: tables ``[[touch]]`` with ``start_s``, ``end_s`` and, if wanted, ``sensor``.

    Raises:
        RecordingError: the file cannot be read, or a touch has no beginning before its end.
    """
    try:
        tables = tomllib.loads(read_file(path, _MAX_SIZE).decode("utf-8-sig")).get("touch", [])
        labels = [TouchLabel(item["start_s"], item["end_s"], str(item.get("sensor", ""))) for item in tables]
    except OSError as exc:
        raise RecordingError(f"cannot read the labels {path}: {exc.strerror or exc}") from exc
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as exc:
        raise RecordingError(f"{path} has no [[touch]] with start_s and end_s: {type(exc).__name__}: {exc}") from exc
    for label in labels:
        if not (is_time(label.start) and is_time(label.end) and label.start < label.end):
            raise RecordingError(f"{path}: start_s must be before end_s, got {label.start!r} s and {label.end!r} s")
    return sorted(labels)


def true_touches(run: Run) -> list[TouchLabel] | None:
    """Return with what the virtual skin of a run was touched, by a script or by bodies; None where nothing tells.

    Raises:
        RecordingError: what the recording tells is damaged.
    """
    told = [block for block in run.select(kinds=_TRUTH) if contact_force(block.payload) is None]
    if not told:
        return None
    labels: list[TouchLabel] = []
    by_bodies: dict[tuple[str, float], TouchLabel] = {}  # each told as it begins, and again once it is over
    for block in told:
        try:
            facts = read_json(block.payload)
            if not _TELLS & facts.keys():
                raise ValueError(f"none of {', '.join(sorted(_TELLS))} in it")
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


def _label(touch: dict[str, Any], began: float) -> TouchLabel:
    start, end = touch["start"], math.inf if touch["end"] is None else touch["end"]
    if not (is_time(start) and isinstance(end, int | float) and start <= end):
        raise ValueError(f"a touch from {start} to {end} s")
    return TouchLabel(start - began, end - began, str(touch["sensor"]))


def recorded_labels(recorded: Decisions) -> list[TouchLabel]:
    """Return the contacts that the guard saw when the run was recorded, as if they were all that there was."""
    labels: list[TouchLabel] = []
    open_since: dict[str, float] = {}
    for event in recorded.events:
        sensor, time = str(event.details.get("sensor", "")), event.time - recorded.start
        if event.name == EventName.CONTACT:
            open_since.setdefault(sensor, time)
        elif event.name == EventName.TOUCH_ENDED and sensor in open_since:
            labels.append(TouchLabel(open_since.pop(sensor), time, sensor, _EARLY))
    labels += [TouchLabel(start, math.inf, sensor, _EARLY) for sensor, start in open_since.items()]
    return sorted(labels)
