"""A reader made from docs/look-up/recording.md alone finds the same blocks, and calls the same recordings whole."""

from pathlib import Path
from random import Random

import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.recorder import Recorder
from tests.support.paths import COLLISION
from tests.support.sweep import sweep

from .independent_reader import read


def agree(path: Path) -> bool:
    """Compare the blocks; return whether both call the recording whole."""
    blocks, broken = read(path)
    ours = read_recording(path)
    assert [tuple(block) for block in ours] == blocks
    assert bool(ours.defects) == bool(broken), (ours.defects, broken)
    return not broken


def test_it_agrees_on_a_collision() -> None:
    assert agree(COLLISION)
    assert len(read(COLLISION)[0]) > 3000


def test_it_agrees_on_several_files(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.rec", part_size=3000, copied=frozenset({20})) as recorder:
        recorder.write(Block(20, 0.0, b"{}"))
        for number in range(50):
            recorder.write(Block(1, 0.1 * number, Random(number).randbytes(300)))
    assert agree(tmp_path / "run.rec")
    assert (tmp_path / "run.0003.rec").exists()


@pytest.mark.parametrize("seed", sweep(range(40), short=8))
def test_it_agrees_on_what_is_damaged(tmp_path: Path, seed: int) -> None:
    with Recorder(tmp_path / "run.rec") as recorder:
        for number in range(40):
            recorder.write(Block(1 + number % 4, 0.01 * number, Random(number).randbytes(60)), flush=True)
    random = Random(seed)
    data = bytearray((tmp_path / "run.rec").read_bytes())
    at = random.randrange(28, len(data))
    match seed % 4:
        case 0:
            data[at] ^= 1 << random.randrange(8)
        case 1:
            del data[at:]
        case 2:
            del data[at : at + random.randrange(1, 500)]
        case 3:
            data[at:at] = data[28 : 28 + random.randrange(1, 2000)]
    (tmp_path / "run.rec").write_bytes(data)
    assert not agree(tmp_path / "run.rec")
