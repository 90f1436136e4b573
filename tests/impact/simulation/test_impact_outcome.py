"""What only physics knows, as blocks of a recording: at a bounded rate, and nothing lost at beginning and end."""

from __future__ import annotations

import json
from typing import Any

import pytest

from coneskin.core.recording.block import Block
from coneskin.impact.simulation.impact_outcome import TouchRecorder, TruthRecorder
from coneskin.robot.guard.signals.journal import BlockKind, body_places, contact_force, force_block
from coneskin.skin.virtual.skin import Press

FIRM, OTHER = Press("a", 0.1, 1.0, 3.0), Press("b", 0.2, 2.0, 4.0)


def told_touches(*instants: tuple[float, list[Press]]) -> list[list[dict[str, Any]]]:
    recorder = TouchRecorder()
    blocks = [block for time, presses in instants if (block := recorder.feed(time, presses)) is not None]
    return [json.loads(block.payload)["pressed"] for block in blocks]


def test_a_touch_is_told_as_it_begins_and_once_it_is_over() -> None:
    first, begun, over = told_touches((1.0, []), (1.1, [FIRM]), (1.2, [FIRM]), (1.25, []), (1.4, []), (1.6, []))
    assert first == []
    assert begun == [{"sensor": "a", "start": 1.1, "end": None, "u": 0.1, "phi": 1.0, "force": 3.0, "radius": 0.0}]
    assert over == [{**begun[0], "end": 1.2}]


def test_a_body_that_rebounds_for_less_than_a_tenth_of_a_second_has_made_one_touch() -> None:
    _, _, over = told_touches((1.0, []), (1.1, [FIRM]), (1.11, []), (1.2, [FIRM]), (1.21, []), (1.4, []))
    assert [(one["start"], one["end"]) for one in over] == [(1.1, 1.2)]


def test_what_no_skin_feels_is_no_touch_and_small_forces_of_several_bodies_are_one() -> None:
    """The layers meet at 0.5 N."""
    light, heavier = FIRM._replace(force=0.3), FIRM._replace(u=0.12, force=0.4)
    assert told_touches((1.0, [light]), (1.1, [light])) == [[]]
    _, touch = told_touches((1.0, []), (1.1, [light, heavier]))
    assert (touch[0]["u"], round(touch[0]["force"], 9)) == (0.12, 0.7)


def test_each_skin_has_its_own_touch() -> None:
    _, first, second, over = told_touches(
        (1.0, []), (1.1, [FIRM]), (1.15, [FIRM, OTHER]), (1.24, [FIRM]), (1.3, [FIRM])
    )
    assert [touch[0]["sensor"] for touch in (first, second, over)] == ["a", "b", "b"]
    assert over[0]["end"] == 1.15


HERE, THERE = ((0.1, 0.2, 0.3),), ((0.1, 0.2, 0.3003),)


def told(
    recorder: TruthRecorder, *instants: tuple[float, float, tuple[tuple[float, float, float], ...]]
) -> list[Block]:
    return [block for instant in instants if (block := recorder.feed(*instant)) is not None]


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
