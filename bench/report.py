"""Report of a benchmark: machine, date and commit of the run, and quantiles of what it measured."""

from __future__ import annotations

import math
import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

__all__ = ["commit", "head", "quantile"]


def commit() -> str:
    """Return the commit that is checked out, with "-dirty" where a file of it has changed."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--exclude=*"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip() or "unknown"


def head(*packages: str) -> str:
    """Return two lines: processor, cores, versions; commit (with "-dirty" where a file of it has changed), date, load.

    Args:
        packages: names of distributions whose versions matter; those that are not installed are left out.
    """
    python = f"Python {platform.python_version()}"
    versions = ", ".join([python, *(f"{name} {found}" for name in packages if (found := _version(name)))])
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, {versions}\n"
        f"commit {commit()}, {datetime.now(UTC):%F %R} UTC{load}"
    )


def quantile(values: Sequence[float], share: float) -> float:
    """Return the value below which this share of the values lies; NaN where there are none."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else math.nan


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
