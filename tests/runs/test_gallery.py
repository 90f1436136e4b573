"""The gallery: each of its runs replays bit by bit, shows its situation, and is what its script records."""

import subprocess
import sys
from pathlib import Path

import pytest

import coneskin
from coneskin.cli import main
from coneskin.core.errors import RecordingError
from coneskin.robot.guard.signals.journal import EventName
from coneskin.runs.replay.run import read_run
from tests.support.paths import ROOT

FOLDER = Path(coneskin.__file__).parent / "runs" / "gallery"
#: run -> an event that only this situation has, and what a part of the events says
SITUATIONS = {
    "hand": (EventName.RETREATED, "the distance is made"),
    "palm": (EventName.CONTACT_EXTENDED, "phi = 0.0 deg"),
    "grip": (EventName.CONTACT_EXTENDED, "several contacts"),
    "slide": (EventName.LATCHED, "phi = 141"),
    "wire": (EventName.FAULT, "the wire of A or of B is open"),
}


def test_the_gallery_is_small_and_has_a_picture_of_each_run() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == SITUATIONS.keys()
    pictures = [ROOT / "docs" / "images" / f"gallery-{name}.png" for name in SITUATIONS]
    assert sum(path.stat().st_size for path in [*FOLDER.iterdir(), *pictures]) < 1_000_000


@pytest.mark.parametrize("name", SITUATIONS)
def test_a_run_of_the_gallery_replays_bit_by_bit_and_shows_its_situation(name: str) -> None:
    """Where this fails, a change has altered what the guard decides: see why, then `scripts/record_gallery.py`."""
    run = read_run(f"gallery:{name}")
    replay = run.replay()
    assert replay.verdict == "same", replay.differences
    event, words = SITUATIONS[name]
    assert event in {each.name for each in run.events}
    assert EventName.STANDSTILL in {each.name for each in run.events}
    assert words in "\n".join(run.timeline(run.events))


def test_a_retreat_leads_away_from_what_has_one_certain_place_only() -> None:
    events = {name: {event.name for event in read_run(f"gallery:{name}").events} for name in SITUATIONS}
    moved = {name for name, names in events.items() if EventName.RETREATING in names}
    assert moved == {"hand"}


@pytest.mark.long
def test_a_command_takes_a_run_of_the_gallery(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "gallery:palm", "--events"]) == 0
    assert "the same, bit by bit" in capsys.readouterr().out
    assert main(["replay", "gallery:palm", "gallery:hand", "--jobs", "1"]) == 0
    assert "2 of 2 runs replayed the same as recorded" in capsys.readouterr().out
    assert main(["runs", "info", "gallery:wire"]) == 0
    assert "the wire of A or of B is open" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["gallery:", "gallery:elbow"])
def test_a_run_that_the_gallery_lacks_is_told_with_those_that_it_has(name: str) -> None:
    with pytest.raises(RecordingError, match=f"there is no run {name}: name one of gallery:grip, gallery:hand, "):
        read_run(name)


@pytest.mark.long
def test_the_script_records_the_same_bytes_again(tmp_path: Path) -> None:
    """Header aside, which says by which Python and version it was made."""
    words = ["--recordings", str(tmp_path), "--pictures", str(tmp_path), "--only", "palm,wire"]
    subprocess.run([sys.executable, "scripts/record_gallery.py", *words], cwd=ROOT, check=True, timeout=120)
    for name in ("palm", "wire"):
        made, kept = read_run(tmp_path / f"{name}.rec"), read_run(f"gallery:{name}")
        assert list(made.blocks) == list(kept.blocks)
