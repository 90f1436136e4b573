"""Playback: what is shown when."""

import math

import pytest

from coneskin.view.playback import Playback


def test_it_stands_until_it_is_played_and_then_goes_at_its_speed() -> None:
    playback = Playback(2.0, 10.0)
    assert playback.advance(100.0) == 2.0
    playback.speed = 0.1
    playback.play(101.0)
    assert playback.advance(106.0) == pytest.approx(2.5)
    playback.speed = 4.0
    assert playback.advance(107.0) == pytest.approx(6.5)


def test_it_pauses_at_the_end_and_plays_again_from_the_beginning() -> None:
    playback = Playback(0.0, 1.0)
    playback.play(0.0)
    assert playback.advance(5.0) == 1.0
    assert not playback.playing
    playback.play(6.0)
    assert playback.advance(6.25) == pytest.approx(0.25)


def test_a_pause_takes_no_time_of_the_run() -> None:
    playback = Playback(0.0, 10.0)
    playback.play(0.0)
    playback.advance(1.0)
    playback.pause()
    assert playback.advance(50.0) == 1.0
    playback.play(60.0)
    assert playback.advance(61.0) == 2.0


@pytest.mark.parametrize(("asked", "shown"), [(5.0, 5.0), (-3.0, 0.0), (99.0, 10.0), (math.nan, 4.0), (math.inf, 4.0)])
def test_one_can_jump_to_what_there_is(asked: float, shown: float) -> None:
    playback = Playback(0.0, 10.0)
    playback.show(4.0)
    playback.show(asked)
    assert playback.time == shown
