"""Decisions of another version of coneskin, which runs in an interpreter of its own."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from coneskin.core.errors import RecordingError

from .decisions import Decisions
from .event_file import parse_events

__all__ = ["decide_with"]

_TIMEOUT = 3600.0  # s


def decide_with(python: Path, recording: Path, reference: Decisions) -> Decisions:
    """Return what another version of coneskin makes of a run; its commands are not known.

    Args:
        python: the interpreter of an environment in which that version is installed.
        recording: the run.
        reference: decisions in the same run, for its start and for what it has lost.

    Raises:
        RecordingError: the interpreter cannot be started, or its coneskin cannot replay the run.
    """
    command = [str(python), "-m", "coneskin", "replay", str(recording), "--json"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT, check=False)
    except (OSError, subprocess.TimeoutExpired) as exc:
        raise RecordingError(f"{python} does not replay {recording}: {exc}") from exc
    try:
        facts = json.loads(done.stdout.splitlines()[-1])
    except (ValueError, IndexError) as exc:
        said = done.stderr.strip().splitlines()
        raise RecordingError(
            f"{python} does not replay {recording}: {said[-1] if said else 'it says nothing'}"
        ) from exc
    events = parse_events(facts, reference.start, str(python))
    return Decisions(str(python), tuple(events), None, reference.start, reference.until, reference.missing)
