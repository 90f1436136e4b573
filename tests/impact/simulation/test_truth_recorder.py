"""What only physics knows, as blocks of a recording: at a bounded rate, and nothing lost at beginning and end."""

from __future__ import annotations

import pytest

from coneskin.core.recording.block import Block
from coneskin.impact.simulation.truth_recorder import TruthRecorder
from coneskin.robot.guard.signals.journal import BlockKind, body_places, contact_force, force_block

HERE, THERE = ((0.1, 0.2, 0.3),), ((0.1, 0.2, 0.3003),)


def told(
    recorder: TruthRecorder, *instants: tuple[float, float, tuple[tuple[float, float, float], ...]]
) -> list[Block]:
    return [block for instant in instants if (block := recorder.take(*instant)) is not None]


def test_a_force_that_changes_is_told_once_a_period_but_its_beginning_and_end_at_once() -> None:
    blocks = told(
        TruthRecorder(0.01),
        (1.0, 0.0, HERE),
        (1.001, 3.0, HERE),
        (1.002, 5.0, HERE),
        (1.0111, 7.0, HERE),
        (1.012, 7.5, HERE),
        (1.013, 0.0, HERE),
        (1.5, 0.0, HERE),
    )
    assert [(block.time, contact_force(block.payload)) for block in blocks] == [
        (1.001, 3.0),
        (1.0111, 7.0),
        (1.013, 0.0),
    ]


def test_a_body_that_nothing_touches_is_told_where_it_moves() -> None:
    (block,) = told(TruthRecorder(0.01), (1.0, 0.0, HERE), (1.1, 0.0, HERE), (1.2, 0.0, THERE), (1.3, 0.0, THERE))
    assert (block.time, body_places(block.payload)) == (1.2, THERE)


def test_what_was_told_is_told_again_for_who_looks_on_from_later() -> None:
    """A page that is opened then knows where a body came to rest."""
    recorder = TruthRecorder(0.01)
    assert told(recorder, (1.0, 0.0, HERE), (30.0, 0.0, HERE)) == []  # where the scene puts it
    instants = [(31.0 + k, 0.0, THERE) for k in range(25)]
    blocks = told(recorder, *instants)
    assert [(block.time, body_places(block.payload)) for block in blocks] == [
        (31.0, THERE),
        (41.0, THERE),
        (51.0, THERE),
    ]


NONSENSE = [
    b'{"bodies_m": [[1, 2]]}',
    b'{"bodies_m": 3}',
    b'{"bodies_m": [[1, 2, NaN]]}',
    b'{"bodies_m": [[1, 2, 1e999]]}',
]
NONSENSE += [b'{"bodies_m": [[1, 2, 1' + b"0" * 400 + b"]]}"]


@pytest.mark.parametrize("payload", [b"", b"[1]", b'{"touches": []}', *NONSENSE])
def test_nonsense_and_another_truth_have_no_places(payload: bytes) -> None:
    assert body_places(payload) == ()


def test_a_reader_of_forces_alone_reads_a_block_with_places() -> None:
    block = force_block(1.0, 12.5, HERE)
    assert block.kind == BlockKind.TRUTH
    assert contact_force(block.payload) == 12.5
    assert body_places(force_block(1.0, 12.5).payload) == ()
