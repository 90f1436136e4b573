"""Report of a benchmark: machine, commit, date and quantiles of a run, its tables, and its JSON file for `--save`.

A file bench/results/NAME.json holds the newest run of a bench, NAME.WHAT.json that of a run with other options.
"""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).with_name("results")
_TABLES: list[dict[str, Any]] = []  # of this run, for its JSON file


def commit() -> str:
    """Return the commit that is checked out, with "-dirty" where a file of it has changed."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--exclude=*"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip() or "unknown"


def machine(*packages: str) -> str:
    """Return processor, cores, system, versions and load; of packages that are not installed nothing is said."""
    python = f"Python {platform.python_version()}"
    versions = ", ".join([python, *(f"{name} {found}" for name in packages if (found := _version(name)))])
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, {versions}{load}"


def head(*packages: str) -> str:
    """Return two lines: machine; commit and date."""
    return f"{machine(*packages)}\ncommit {commit()}, {datetime.now(UTC):%F %R} UTC"


def quantile(values: Sequence[float], share: float) -> float:
    """Return the value below which this share of the values lies; NaN where there are none."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else math.nan


def show(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table, and keep it for the JSON file of this run."""
    _TABLES.append({"title": title, "columns": list(columns), "rows": [[str(cell) for cell in row] for row in rows]})
    print(f"\n{title}\n{text_table(columns, rows)}", flush=True)


def text_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table as text: the first column to the left, the others to the right, two spaces between them."""
    lines = [[str(cell) for cell in row] for row in (columns, *rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    cells = (
        [
            cell.rjust(width) if k else cell.ljust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        for line in lines
    )
    return "\n".join("  ".join(line).rstrip() for line in cells)


def save(bench: str, options: Sequence[str], not_shown: str, printed: str, what: str = "") -> Path:
    """Write the JSON file of this run.

    Args:
        bench: its name.
        options: of its command line.
        not_shown: what its figures do not show.
        printed: all that it printed, for a bench that shows no table.
        what: these options do, where the bench is run with others too; part of the file's name.

    Returns:
        The file.
    """
    file = RESULTS / f"{bench}{'.' * bool(what)}{what}.json"
    run: dict[str, Any] = {
        "bench": bench,
        "command": " ".join(["python -m bench", bench, *options]),
        "commit": commit(),
        "date": f"{datetime.now(UTC):%F}",
        "machine": machine(),
        "not_shown": not_shown,
        **({"tables": _TABLES} if _TABLES else {"printed": printed.strip("\n").splitlines()}),
    }
    RESULTS.mkdir(exist_ok=True)
    file.write_text(json.dumps(run, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return file


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = (line.split(":")[-1].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
