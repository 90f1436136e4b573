"""Recordings of version 1 are still read, and found again behind damage."""

from pathlib import Path

import pytest

from coneskin.core.recording.defect import DefectKind
from coneskin.core.recording.reader import read_recording
from tests.support.paths import ROOT

OLD = ROOT / "tests" / "data" / "collision-version-1.rec"


def test_it_is_read_whole() -> None:
    got = read_recording(OLD)
    assert (got.version, got.missing, len(list(got.blocks))) == (1, "", 3150)


@pytest.mark.parametrize("at", [20, 40_000, 117_000, 250_000, 352_700])
def test_a_flipped_bit_costs_one_block(tmp_path: Path, at: int) -> None:
    data = bytearray(OLD.read_bytes())
    data[at] ^= 4
    (tmp_path / "run.rec").write_bytes(data)
    got, whole = list(read_recording(tmp_path / "run.rec").blocks), list(read_recording(OLD).blocks)
    defects = read_recording(tmp_path / "run.rec").defects
    assert len(got) == len(whole) - 1
    assert all(block in whole for block in got)
    assert [defect.kind for defect in defects] == [DefectKind.LOST]


def test_a_torn_end_is_said(tmp_path: Path) -> None:
    (tmp_path / "run.rec").write_bytes(OLD.read_bytes()[:200_001])
    assert [defect.kind for defect in read_recording(tmp_path / "run.rec").defects] == [DefectKind.NOT_CLOSED]
