"""Files of events: what is there stays where its successor cannot be written."""

import resource
import subprocess
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.errors import RecordingError
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.event_file import _read_events, _write_events, decide_with


def test_reviewed_events_survive_a_full_disk(tmp_path: Path) -> None:
    path = tmp_path / "run.events.json"
    reviewed = [GuardEvent(EventName.CONTACT, 1.5, {"sensor": "forearm"})]
    _write_events(path, reviewed, 1.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with pytest.raises(RecordingError, match="cannot write the events"):
            _write_events(path, reviewed * 10, 1.0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert _read_events(path, 1.0) == reviewed
    assert list(tmp_path.iterdir()) == [path]


def test_another_version_has_an_hour_to_replay_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def never_ends(command: list[str], *, timeout: float, **_: Any) -> None:
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", never_ends)
    with pytest.raises(
        RecordingError, match=r"old/python does not replay run\.rec: .* timed out after 3600\.0 seconds"
    ):
        decide_with(Path("old/python"), Path("run.rec"), None)  # type: ignore[arg-type]
