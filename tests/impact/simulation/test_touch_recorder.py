"""Touches that bodies make: when each began and ended, whatever presses, rebounds or rests."""

from __future__ import annotations

import json
from typing import Any

from coneskin.impact.simulation.touch_recorder import TouchRecorder
from coneskin.skin.virtual.pressed_skin import Press

FIRM, OTHER = Press("a", 0.1, 1.0, 3.0), Press("b", 0.2, 2.0, 4.0)


def told(*instants: tuple[float, list[Press]]) -> list[list[dict[str, Any]]]:
    recorder = TouchRecorder()
    blocks = [block for time, presses in instants if (block := recorder.take(time, presses)) is not None]
    return [json.loads(block.payload)["pressed"] for block in blocks]


def test_a_touch_is_told_as_it_begins_and_once_it_is_over() -> None:
    first, begun, over = told((1.0, []), (1.1, [FIRM]), (1.2, [FIRM]), (1.25, []), (1.4, []), (1.6, []))
    assert first == []
    assert begun == [{"sensor": "a", "start": 1.1, "end": None, "u": 0.1, "phi": 1.0, "force": 3.0, "radius": 0.0}]
    assert over == [{**begun[0], "end": 1.2}]


def test_a_body_that_rebounds_for_less_than_a_tenth_of_a_second_has_made_one_touch() -> None:
    _, _, over = told((1.0, []), (1.1, [FIRM]), (1.11, []), (1.2, [FIRM]), (1.21, []), (1.4, []))
    assert [(one["start"], one["end"]) for one in over] == [(1.1, 1.2)]


def test_what_no_skin_feels_is_no_touch_and_small_forces_of_several_bodies_are_one() -> None:
    """The layers meet at 0.5 N."""
    light, heavier = FIRM._replace(force=0.3), FIRM._replace(u=0.12, force=0.4)
    assert told((1.0, [light]), (1.1, [light])) == [[]]
    _, touch = told((1.0, []), (1.1, [light, heavier]))
    assert (touch[0]["u"], round(touch[0]["force"], 9)) == (0.12, 0.7)


def test_each_skin_has_its_own_touch() -> None:
    _, first, second, over = told((1.0, []), (1.1, [FIRM]), (1.15, [FIRM, OTHER]), (1.24, [FIRM]), (1.3, [FIRM]))
    assert [touch[0]["sensor"] for touch in (first, second, over)] == ["a", "b", "b"]
    assert over[0]["end"] == 1.15
