"""Memory of the commands on a long run, each in a process of its own. See replay.py."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import read_run

_TOUCHES_PROGRAM = "import sys; from coneskin import read_run; read_run(sys.argv[1]).touches()"


def memory(model: Path, folder: Path, megabytes: int) -> Iterator[str]:
    """Yield lines of a table: the most memory that each command had, and its time."""
    run = folder / "run.rec"
    seconds = _repeat(model, run, megabytes << 20)
    yield f"a run of {run.stat().st_size / 1e6:.0f} MB, {seconds:.0f} s: a touch in each minute"
    yield f"{'':30} {'MB at most':>10} {'s of the processor':>19}"
    coneskin, name = [sys.executable, "-m", "coneskin"], str(run)
    around = f"{seconds / 2 // 60 * 60 + 58.5:.1f}"
    commands = {
        "runs list": [*coneskin, "runs", "list", str(folder)],
        "runs info": [*coneskin, "runs", "info", name],
        "runs verify": [*coneskin, "runs", "verify", name],
        "runs cut": [*coneskin, "runs", "cut", name, "--around", around, "-o", str(folder / "cut.out")],
        "touches": [sys.executable, "-c", _TOUCHES_PROGRAM, name],
        "replay": [*coneskin, "replay", name],
        "runs diff": [*coneskin, "runs", "diff", name],
        **{
            f"runs export --format {form}": [
                *(*coneskin, "runs", "export", name, "--format", form),
                *("-o", str(folder / (form if form in ("csv", "parquet") else f"out.{form}"))),
            ]
            for form in ("csv", "parquet", "npz", "mcap")
        },
        "runs prune": [*coneskin, "runs", "prune", name],
    }
    for words, command in commands.items():
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        said = process.stderr.read().strip().splitlines()
        _, status, used = os.wait4(process.pid, 0)
        code = os.waitstatus_to_exitcode(status)
        failed = f"  exit code {code}: {said[-1] if said else ''}" if code else ""
        yield f"{words:30} {used.ru_maxrss / 1e3:10.0f} {used.ru_utime + used.ru_stime:19.1f}{failed}"


def _repeat(model: Path, path: Path, size: int) -> float:
    """Write the blocks of a run again and again, each time later, up to a size [bytes]; return how long it is [s]."""
    run = read_run(model)
    blocks = [block for block in run.blocks if block.kind != BlockKind.EVENT]
    header = next(iter(run.copies))
    length = blocks[-1].time - blocks[0].time + 0.001
    with Recorder(path, copied=frozenset({BlockKind.HEADER})) as recorder:
        recorder.write(header)
        written = 0.0
        while path.stat().st_size < size:
            for block in blocks:
                recorder.write(block._replace(time=block.time + written))
            written += length
    return written
