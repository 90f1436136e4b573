"""The next command that is printed is one that a shell takes, and a page ends as its options say."""

from __future__ import annotations

import argparse
import io
import json
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from coneskin.cli import main
from coneskin.commands.demo import _collision_facts, _print_report
from coneskin.commands.terminal import add_page_options, print_hint, print_line, show_page
from coneskin.runs.replay.run import Run
from coneskin.scene.reader import parse_scene

from ..scene.scenes import SKIN_ONLY
from .test_guard import FakeSession, events
from .test_permissible import write


@pytest.mark.parametrize(
    ("encoding", "folder", "printed"),
    [
        ("utf-8", "häute/1", True),
        ("latin-1", "häute/1", True),
        ("ascii", "häute/1", False),
        ("ascii", "two words", True),
        ("utf-8", "\udce4 of no encoding", False),
        ("utf-8", "an\x1b[2Jescape", False),
        ("utf-8", "two\nlines", False),
    ],
)
def test_a_hint_is_the_command_or_is_left_out(
    monkeypatch: pytest.MonkeyPatch, encoding: str, folder: str, printed: bool
) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding, errors="backslashreplace"))
    print_hint(f"next: coneskin init {shlex.quote(folder)}")
    words = shlex.split(raw.getvalue().decode(encoding))
    assert words == (["next:", "coneskin", "init", folder] if printed else [])


def test_a_line_is_written_in_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines of two threads would share one otherwise: ``print`` writes the line's end on its own."""
    written: list[str] = []
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(write=written.append, flush=lambda: None))
    print_line("5.6052 s  stop: touch")
    assert written == ["5.6052 s  stop: touch\n"]


@pytest.mark.parametrize(("words", "ends"), [([], []), (["--duration-s", "2"], [2.0])])
def test_a_page_ends_after_its_time_and_without_one_not_by_itself(
    words: list[str], ends: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    timers: list[tuple[float, Callable[[], None]]] = []
    monkeypatch.setattr("threading.Timer", lambda *what: SimpleNamespace(start=lambda: timers.append(what)))
    monkeypatch.setattr("signal.signal", lambda *_: None)
    parser = argparse.ArgumentParser()
    add_page_options(parser, 8080)
    over = show_page(parser.parse_args([*words, "--no-browser"]), "http://localhost:8080", "it is at {}")
    assert [seconds for seconds, _ in timers] == ends
    assert not over.is_set()
    for _, end in timers:
        end()
    assert over.is_set() is bool(ends)


def test_a_guard_ends_with_the_replay_of_what_it_has_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def check(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys, "stdin", [])
    monkeypatch.setattr("signal.signal", lambda *_: None)
    scene = tmp_path / "scene.toml"
    scene.write_text(SKIN_ONLY)
    session = FakeSession(parse_scene(SKIN_ONLY), events("activated"), [], check)
    monkeypatch.setattr("coneskin.session.session.guard", lambda *_, **__: session)
    session.recording = tmp_path / "a run" / "run.rec"
    assert main(["guard", str(scene)]) == 0
    assert "next:" not in capsys.readouterr().out  # a guard that did not become active leaves no recording
    session.recording.parent.mkdir()
    session.recording.write_bytes(b"")
    assert main(["guard", str(scene)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert shlex.split(said) == ["next:", "coneskin", "replay", str(session.recording), "--events"]
    assert main(["guard", str(scene), "--json"]) == 0
    assert "next:" not in capsys.readouterr().out


def test_the_demo_ends_with_the_replay_of_its_run(capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path("runs") / "of two words"
    facts = _collision_facts(Run({}, ()), 0.0)
    facts |= {"same_in_replay": True, "picture": None}
    _print_report(facts, folder, "")
    said = shlex.split(capsys.readouterr().out.splitlines()[-1])
    assert said == ["next:", "coneskin", "replay", str(folder), "--events"]


@pytest.mark.long
def test_permissible_speeds_name_the_key_and_the_next_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from coneskin.impact.permissible_speed import speed_map

    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (1.0, float("inf")))
    words = write(tmp_path)
    assert main(words) == 0
    said = shlex.split(capsys.readouterr().out.splitlines()[-1])
    assert said == ["next:", "coneskin", *words, "-o", "impact.toml"]
    (tmp_path / "speeds").mkdir()
    monkeypatch.chdir(tmp_path / "speeds")
    assert main([*words, "-o", "impact.toml"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert shlex.split(lines[-1])[-4:] == ["coneskin", "doctor", words[1], "--check"]
    value = next(line for line in lines if "speed_limit_from" in line).split(" = ")[1]
    assert json.loads(value) == "speeds/impact.toml"  # from the scene's folder, not from where the command runs


def test_lines_whose_reader_has_gone_go_nowhere() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w", encoding="utf-8") as gone:
        print_line("a guard says this", gone)
        print_line("and goes on", gone)
