"""A run that did not start leaves no folder behind, and one that did keeps its own."""

from pathlib import Path

import pytest

from coneskin.core.errors import SkinConnectionError
from coneskin.runs.replay.run import read_run
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard

from ..scene.scenes import SKIN_ONLY

RECORDED = SKIN_ONLY.split("[[source.touch]]")[0] + '\n[recording]\nfolder = "runs"\nmax_mb = 2\nkeep = 3\n'


@pytest.mark.long
def test_a_failed_start_leaves_no_folder_of_a_run(tmp_path: Path) -> None:
    serial = RECORDED.replace('kind = "virtual"', 'kind = "serial"\nport = "/dev/no-such-port"')
    with pytest.raises(SkinConnectionError, match="no-such-port"), guard(parse_scene(serial, "s", tmp_path)):
        pass
    assert list((tmp_path / "runs").iterdir()) == []


@pytest.mark.long
def test_a_start_leaves_one(tmp_path: Path) -> None:
    with guard(parse_scene(RECORDED, "s", tmp_path)) as session:
        assert session.recording is not None
    run = read_run(session.recording)
    assert "activated" in [event.name for event in run.events]
    assert run.missing == ""
    assert run.scene().recording is not None
    assert run.scene().recording.max_size == 2_000_000  # type: ignore[union-attr]
