"""Tables of a run: events, skin frames, states of the arm, speed slider, commands; units stand in the columns' names.

Values are in SI and radians. Times count from the start of the run; ``unix_s`` of the events is the wall clock's.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError, needed_package
from coneskin.core.files import explain_os_error
from coneskin.core.progress import Progress, silent
from coneskin.robot.arm.models import JOINT_COUNT
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.decisions import recorded_commands
from coneskin.runs.replay.event_details import QUANTITIES, is_number, is_vector
from coneskin.runs.replay.run import Run
from coneskin.skin.wire import DRIVEN_HEAD, DrivenPotentials, Frame

#: column -> its values, one for each row: all of one type, or None where there is none
Table = Mapping[str, list[Any]]
#: begins a table anew and yields its pieces, each with the same columns; nothing where it has no rows
Pieces = Callable[[], Iterator[Table]]
_PIECE_ROWS = 1 << 14  # rows
_IDENTIFIER_FIELDS = frozenset({"length", "device", "sensor", "status", "clock_us", "sequence"})  # the rest are counts


def table_pieces(run: Run, progress: Progress = silent) -> dict[str, Pieces]:
    """Return the tables of a run by their names, in pieces that are read one after the other.

    Raises:
        SceneError: this version of coneskin cannot read the scene.
    """
    start = run.start
    return {
        "events": lambda: _events(run, start),
        "frames": lambda: _frames(run, start, progress),
        "arm": lambda: _arm(run, start),
        "slider": lambda: _pieces(("time_s", "fraction"), ((t - start, f) for t, f in run.slider())),
        "commands": lambda: _commands(run, start),
    }


def _pieces(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[Table]:
    """Yield rows as tables of some thousand each."""
    source = iter(rows)
    while piece := list(islice(source, _PIECE_ROWS)):
        yield dict(zip(columns, map(list, zip(*piece, strict=True)), strict=True))


def _events(run: Run, start: float) -> Iterator[Table]:
    events = run.events
    if not events:
        return
    table: dict[str, list[Any]] = {
        "time_s": [event.time - start for event in events],
        "unix_s": [event.time + run.unix_offset for event in events],
        "event": [event.name.value for event in events],
    }
    for name in dict.fromkeys(key for event in events for key in event.details):
        table.update(_columns(name, [event.details.get(name) for event in events]))
    table["details_json"] = [json.dumps(event.details) for event in events]
    yield table


def _columns(name: str, values: Sequence[Any]) -> Iterator[tuple[str, list[Any]]]:
    """Yield the columns of one detail; what is neither number, text nor vector of three is in ``details_json`` only."""
    quantity = QUANTITIES.get(name)
    unit = f"_{quantity.si_unit}" if quantity and quantity.si_unit else ""
    present = [value for value in values if value is not None]
    if all(isinstance(value, bool) for value in present) or all(isinstance(value, str) for value in present):
        yield name, list(values)
    elif all(map(is_number, present)):
        kind = int if all(isinstance(value, int) for value in present) else float
        yield f"{name}{unit}", [None if value is None else kind(value) for value in values]
    elif all(is_vector(value) and len(value) == 3 for value in present):
        for axis, letter in enumerate("xyz"):
            yield f"{name}_{letter}{unit}", [None if value is None else float(value[axis]) for value in values]


def _frames(run: Run, start: float, progress: Progress) -> Iterator[Table]:
    skin = frozenset({BlockKind.SKIN})
    names = [name if name in _IDENTIFIER_FIELDS else f"{name}_counts" for name in Frame._fields[:-1]]
    driven: tuple[None, ...] = ()  # potentials of driven electrodes: only where a frame has them
    if any(DRIVEN_HEAD in block.payload for block in run.select(kinds=skin)):
        driven = (None,) * len(DrivenPotentials._fields)
        names += [f"driven_{name}_counts" for name in DrivenPotentials._fields]
    rows = (
        (time - start, *frame[:-1], *(frame.driven or driven if driven else ())) for time, frame in run.frames(progress)
    )
    return _pieces(("time_s", *names), rows)


def _arm(run: Run, start: float) -> Iterator[Table]:
    first = next(iter(run.states()), None)
    joints = JOINT_COUNT if first is None else len(first.q)
    units = {"q": "rad", "qd": "rad_s", "current": "a", "target_current": "a"}
    flags = ("powered", "stopped_by_safety", "program_running")
    names = [f"{name}{joint}_{unit}" for name, unit in units.items() for joint in range(1, joints + 1)]
    unknown = (math.nan,) * joints
    rows = (
        (
            *(state.time - start, state.controller_time, *state.q, *state.qd),
            *(*(state.current or unknown), *(state.target_current or unknown)),
            *(state.powered, state.stopped_by_safety, state.program_running),
        )
        for state in run.states()
    )
    return _pieces(("time_s", "controller_time_s", *names, *flags), rows)


def _commands(run: Run, start: float) -> Iterator[Table]:
    rows = (
        (command.time - start, command.what, json.dumps(command.numbers)) for command in recorded_commands(run.blocks)
    )
    return _pieces(("time_s", "command", "numbers_json"), rows)


def write_parquet(path: Path, pieces: Iterable[Table]) -> int:
    """Write a table, in pieces with the same columns, as a Parquet file, and return the number of its rows.

    Raises:
        MissingExtra: pyarrow is not installed.
        RecordingError: the file cannot be written.
    """
    with needed_package("pyarrow", "a Parquet file", "tables"):
        import pyarrow as pa
        import pyarrow.parquet as pq
    rows = 0
    with explain_os_error(RecordingError, f"cannot write {path}"), ExitStack() as stack:
        writer = None
        for piece in pieces:
            part = pa.table(dict(piece), schema=None if writer is None else writer.schema)
            if writer is None:
                kinds = [(c.name, pa.int64() if pa.types.is_null(c.type) else c.type) for c in part.schema]
                writer = stack.enter_context(pq.ParquetWriter(path, pa.schema(kinds), compression="zstd"))
                part = part.cast(writer.schema)
            writer.write_table(part)
            rows += part.num_rows
    return rows
