"""Run whose strings are no UTF-8, as from a folder with an old name: each command shows it, none fails at a letter."""

import csv
import json
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.event_file import _read_events, _write_events
from coneskin.runs.replay.run import Run, read_run

HALF = "/skins/caf\udce9"  # a name in Latin-1, as Python reads it
TOLD = r"/skins/caf\udce9"


@pytest.fixture(scope="module")
def recording(collision: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The collision, with such text in the header and in each event."""
    path = tmp_path_factory.mktemp("odd") / "run.rec"
    header = {**collision.header, "folder": HALF}
    with Recorder(path) as recorder:
        recorder.write(Block(BlockKind.HEADER, collision.start, json.dumps(header).encode()))
        recorder.write(*map(_renamed, collision.blocks))
    return path


def _renamed(block: Block) -> Block:
    if block.kind != BlockKind.EVENT:
        return block
    name, details = json.loads(block.payload)
    return block._replace(payload=json.dumps([name, {**details, HALF: 1, "what": HALF}]).encode())


@pytest.mark.parametrize("form", ["csv", "parquet", "npz", "mcap"])
@pytest.mark.long
def test_it_is_exported(recording: Path, tmp_path: Path, form: str) -> None:
    pytest.importorskip({"parquet": "pyarrow", "mcap": "mcap"}.get(form, "numpy"))
    target = tmp_path / f"out.{form}"
    assert main(["runs", "export", str(recording), "--format", form, "-o", str(target)]) == 0
    if form == "csv":
        with (target / "events.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert rows
        assert all((row[TOLD], row["what"]) == ("1", TOLD) for row in rows)


@pytest.mark.parametrize(
    "words", [["runs", "info"], ["runs", "info", "--json"], ["runs", "list"], ["runs", "verify"], ["replay"]]
)
def test_it_is_shown(recording: Path, words: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    code = main([*words, str(recording)])
    printed = capfd.readouterr()
    assert (code, printed.err) == (1 if words == ["replay"] else 0, "")  # no guard of today says such words
    assert printed.out


def test_it_is_drawn_on_a_page(recording: Path, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is written")
    assert main(["view", str(recording), "--html", str(tmp_path / "run.html")]) == 0


def test_its_events_say_what_a_review_reads_back(recording: Path, tmp_path: Path) -> None:
    run = read_run(recording)
    _write_events(tmp_path / "run.events.json", run.events, run.start)
    assert [event.details["what"] for event in _read_events(tmp_path / "run.events.json", run.start)] == [
        TOLD for event in run.events
    ]
