"""What ``make test`` says at its end: one line for each of its two sessions, and why tests were skipped."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from . import conftest


def test_a_session_adds_its_outcomes_and_the_reasons_of_skipped_tests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = tmp_path / "summary"
    skipped = [SimpleNamespace(longrepr=("test_a.py", 3, f"Skipped: {why}")) for why in ("no TLS", "no mesh", "no TLS")]
    sessions = {"processes": {"passed": [0] * 5}, "computing": {"passed": [0], "failed": [0], "skipped": skipped}}
    monkeypatch.setenv("CONESKIN_TEST_SUMMARY", str(told))
    for label, stats in sessions.items():
        monkeypatch.setenv("CONESKIN_TEST_LABEL", label)
        monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")
        conftest.pytest_terminal_summary(SimpleNamespace(stats=stats))  # type: ignore[arg-type]
        monkeypatch.delenv("PYTEST_XDIST_WORKER")
        conftest.pytest_terminal_summary(SimpleNamespace(stats=stats))  # type: ignore[arg-type]
    assert told.read_text() == (
        "processes: 5 passed\ncomputing: 1 passed, 1 failed, 3 skipped\n  2 skipped: no TLS\n  1 skipped: no mesh\n"
    )
