"""_Playback: what is shown when."""

import math
import random
from itertools import pairwise

import pytest

from coneskin.view.live_page import _POSE_DELAY, _Playout
from coneskin.view.run_page import _Playback


def test_it_stands_until_it_is_played_and_then_goes_at_its_speed() -> None:
    playback = _Playback(2.0, 10.0)
    assert playback.poll(100.0) == 2.0
    playback.speed = 0.1
    playback.play(101.0)
    assert playback.poll(106.0) == pytest.approx(2.5)
    playback.speed = 4.0
    assert playback.poll(107.0) == pytest.approx(6.5)


def test_it_pauses_at_the_end_and_plays_again_from_the_beginning() -> None:
    playback = _Playback(0.0, 1.0)
    playback.play(0.0)
    assert playback.poll(5.0) == 1.0
    assert not playback.playing
    playback.play(6.0)
    assert playback.poll(6.25) == pytest.approx(0.25)


def test_a_pause_takes_no_time_of_the_run() -> None:
    playback = _Playback(0.0, 10.0)
    playback.play(0.0)
    playback.poll(1.0)
    playback.pause()
    assert playback.poll(50.0) == 1.0
    playback.play(60.0)
    assert playback.poll(61.0) == 2.0


@pytest.mark.parametrize(("asked", "shown"), [(5.0, 5.0), (-3.0, 0.0), (99.0, 10.0), (math.nan, 4.0), (math.inf, 4.0)])
def test_one_can_jump_to_what_there_is(asked: float, shown: float) -> None:
    playback = _Playback(0.0, 10.0)
    playback.show(4.0)
    playback.show(asked)
    assert playback.time == shown


STEP = 1.0 / 30.0  # s between two pictures
PARCEL = 0.05  # s of a run that its recorder hands over together
RUN = 1000.0  # s by which the run's clock is ahead


def shown(late: float, seconds: float = 4.0, offset: float = RUN) -> list[tuple[float, float, float]]:
    """Clock, newest and what is shown of a run whose parcels come up to so late [s]."""
    playout, chance, found = _Playout(), random.Random(1), []
    parcels = [(k * PARCEL + late * chance.random(), offset + k * PARCEL) for k in range(round(seconds / PARCEL))]
    for picture in range(3, round(seconds / STEP)):
        now = picture * STEP
        newest = max(at for came, at in parcels if came <= now)
        found.append((now, newest, playout.time(newest, now)))
    return found


def test_parcels_become_even_steps() -> None:
    """As they come, the steps would be 0, 50 or 100 ms."""
    found = shown(late=0.01)[30:]
    raw = [after[1] - before[1] for before, after in pairwise(found)]
    steps = [after[2] - before[2] for before, after in pairwise(found)]
    assert max(raw) - min(raw) > 0.04
    assert min(steps) > 0.95 * STEP
    assert max(steps) < 1.05 * STEP


def test_what_is_shown_is_late_by_the_delay() -> None:
    """Of a run whose parcels come at once; the offset is seen at pictures, which fall a third of a step apart."""
    for now, _, at in shown(late=0.0)[30:]:
        assert at == pytest.approx(now + RUN - _POSE_DELAY, abs=STEP / 3.0)


@pytest.mark.parametrize("late", [0.0, 0.03, 0.2])
def test_it_is_never_ahead_and_never_runs_back(late: float) -> None:
    found = shown(late)
    assert all(at <= newest for _, newest, at in found)
    assert all(after[2] >= before[2] for before, after in pairwise(found))


def test_a_run_that_ends_is_shown_to_its_end() -> None:
    playout = _Playout()
    playout.time(RUN, 1.0)
    assert playout.time(RUN, 1.0 + 0.5 * _POSE_DELAY) < RUN
    assert playout.time(RUN, 2.0) == RUN


def test_a_parcel_after_a_silence_is_caught_up_with() -> None:
    """A computer that slept: what came late once does not stay late."""
    playout = _Playout()
    playout.time(RUN, 1.0)
    playout.time(RUN + 1.0, 5.0)  # came three seconds late
    assert playout.time(RUN + 5.0, 6.0) == pytest.approx(RUN + 5.0 - _POSE_DELAY)
