"""A cut is small, replays to the same contacts, and says what it was cut from."""

from dataclasses import replace
from pathlib import Path

import pytest

from coneskin.core.errors import RecordingError
from coneskin.core.recording.defects import Defect, DefectKind
from coneskin.core.version import code_versions, recorded_version
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.cut import cut_run
from coneskin.runs.replay.event_details import Tolerances
from coneskin.runs.replay.run import Run, read_run
from coneskin.runs.run_files import summarise_run


@pytest.mark.long
def test_a_cut_replays_to_the_same_contact_and_reaction(collision: Run, tmp_path: Path) -> None:
    cut = cut_run(collision, tmp_path / "cut.rec", around=2.95, keep=1.0, name="demo")
    assert cut.size < 300_000
    assert (cut.contacts, cut.active) == (1, True)
    assert cut.comparison.differences == ()
    run = read_run(cut.path)
    result = run.replay()
    assert result.same
    assert not run.missing
    names = [event.name for event in result.events]
    wanted = ["stopping", "contact", "retreating"]
    assert [name for name in names if name in wanted] == wanted
    contact = next(event for event in result.events if event.name == "contact")
    whole = next(event for event in collision.events if event.name == "contact")
    assert contact.time == whole.time
    assert contact.details["u"] == pytest.approx(whole.details["u"], abs=5e-4)
    summary = summarise_run(cut.path, run)
    assert summary["cut"] == {"from": "demo", "around_s": 2.95, "keep_s": 1.0}
    assert summary["duration_s"] < 1.2


@pytest.mark.long
def test_a_cut_that_shows_another_reaction_says_so(collision: Run, tmp_path: Path) -> None:
    assert cut_run(collision, tmp_path / "cut.rec", around=2.95).other_reaction == ""
    late = collision.start + 1.5  # from here on the controller's states come 60 ms late, which a cut cannot know
    blocks = [
        block._replace(time=block.time + 0.06) if block.kind == BlockKind.ARM and block.time > late else block
        for block in collision.blocks
    ]
    lagging = replace(collision, blocks=tuple(sorted(blocks, key=lambda block: block.time)))
    cut = cut_run(lagging, tmp_path / "late.rec", around=2.95)
    assert cut.other_reaction.startswith("stopping, escalated")
    assert cut.other_reaction.endswith("; in the whole run nothing")


@pytest.mark.long
def test_a_cut_without_a_duration_begins_as_early_as_the_same_contacts_need(
    collision: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only a guard that has seen the run from its start knows the zero of the skin to the last bit."""
    monkeypatch.setattr("coneskin.runs.cut.CUT_TOLERANCES", Tolerances(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(RecordingError, match=r"same contacts: .*or name no duration"):
        cut_run(collision, tmp_path / "cut.rec", around=2.95, keep=1.0)
    first = next(block.time for block in collision.blocks if block.kind == BlockKind.SKIN)
    cut = cut_run(collision, tmp_path / "cut.rec", around=2.95)
    assert cut.comparison.differences == ()
    assert collision.start + cut.since <= first
    assert cut.until == pytest.approx(3.45, abs=0.01)


def test_nothing_is_cut_out_of_a_part_that_is_damaged(collision: Run, tmp_path: Path) -> None:
    lost = Defect(DefectKind.LOST, since=collision.start + 3.0, until=collision.start + 3.1, blocks=9)
    with pytest.raises(RecordingError, match=r"the part up to 3\.450 s is not whole"):
        cut_run(replace(collision, defects=(lost,)), tmp_path / "cut.rec", around=2.95)


@pytest.mark.parametrize(
    ("around", "keep", "said"),
    [
        (100.0, 1.0, r"the run has nothing from 9\d\.\d+ s to 100.500 s"),
        (2.6, 0.2, r"no touch begins from .*: nothing to cut out; the run's touches begin at 2\.\d+ s$"),
        (
            3.6,
            0.2,
            "the cut would not show the same contacts: new contact 1: touch is new on forearm skin, u 129.9 mm",
        ),  # in its middle
        (2.95, 0.0, "a duration above 0 s"),
        (float("nan"), 1.0, "a cut needs a moment"),
    ],
)
@pytest.mark.long
def test_where_there_is_no_contact_nothing_is_cut(
    collision: Run, tmp_path: Path, around: float, keep: float, said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        cut_run(collision, tmp_path / "cut.rec", around, keep)
    assert not (tmp_path / "cut.rec").exists()


@pytest.mark.long
@pytest.mark.pure
def test_a_cut_that_the_disk_does_not_take_leaves_nothing(
    collision: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise RecordingError("no space left on device")

    monkeypatch.setattr("coneskin.core.recording.recorder.Recorder._append", full)
    with pytest.raises(RecordingError, match="no space left"):
        cut_run(collision, tmp_path / "cut.rec", around=2.95)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_cut_says_that_its_events_are_those_of_todays_code(collision: Run, tmp_path: Path) -> None:
    run = read_run(cut_run(collision, tmp_path / "cut.rec", around=2.95).path)
    assert run.recorded_by == recorded_version(code_versions())
    assert run.other_code() == ()
