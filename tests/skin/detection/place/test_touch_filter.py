"""Filter of a touch: the noise that it leaves and says, at rest and as it slides, by least squares of its own."""

import math
import random

import numpy as np
import pytest

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, MatrixNoise
from coneskin.skin.detection.place.touch_filter import TouchFilter

SIDES = (0.24, 0.23)  # m
SIGMA = 65e-6  # m; a frame's noise with 12 bits
PERIOD = 1e-3  # s


def matrix(x: float, y: float) -> ContactMatrix:
    return ContactMatrix(1e-3, x / SIDES[0], y / SIDES[1], 1e-3, 0.0, 1e-3, 0.0, 0.0, 0.0)


NOISE = MatrixNoise((SIGMA / SIDES[0]) ** 2, 0.0, (SIGMA / SIDES[1]) ** 2, *[0.0] * 8)


def follow(speed: float, frames: int, rng: random.Random, direction: float = 0.7):
    """Return offsets from the true place [m], and what the filter says of them, frame by frame."""
    track, found = TouchFilter(SIDES), []
    for n in range(frames):
        at = 0.05 + speed * PERIOD * n * math.cos(direction), 0.05 + speed * PERIOD * n * math.sin(direction)
        track.feed(matrix(at[0] + rng.gauss(0.0, SIGMA), at[1] + rng.gauss(0.0, SIGMA)), NOISE, PERIOD)
        _, x, y, *_ = track.values
        xx, xy, yy = track.motion
        said = np.array([[track.share * NOISE.xx + xx, xy], [xy, track.share * NOISE.yy + yy]])
        found.append((np.array([x, y]) - np.array(at) / SIDES, said, track))
    return found


@pytest.mark.parametrize(
    ("speed", "least", "most"), [(0.0, 0.93, 0.98), (0.02, 0.9, 0.98), (0.05, 0.93, 0.98), (0.2, 0.93, 0.99)]
)
def test_the_ellipse_holds_a_touch_that_rests_or_slides(speed, least, most):
    rng = random.Random(3)
    inside = [
        off @ np.linalg.solve(said, off) < 5.991 for _ in range(40) for off, said, _ in follow(speed, 60, rng)[2:]
    ]
    assert least <= np.mean(inside) <= most


def test_at_rest_it_is_nearly_the_mean_of_all_frames():
    rng = random.Random(4)
    last = [follow(0.0, 64, rng)[-1] for _ in range(60)]
    rms = math.sqrt(np.mean([(off[0] * SIDES[0]) ** 2 for off, _, _ in last]))
    assert rms == pytest.approx(SIGMA / 8.0, rel=0.3)
    assert all(track.velocity == (0.0, 0.0) for _, _, track in last)


@pytest.mark.parametrize("speed", [0.1, 1.0])
def test_a_slide_has_its_velocity_and_is_the_line_of_least_squares(speed):
    rng = random.Random(5)
    ((_, _, track),) = follow(speed, 40, rng)[-1:]
    x, y = track.velocity
    assert math.hypot(x * SIDES[0], y * SIDES[1]) / PERIOD == pytest.approx(speed, rel=0.03)
    rng, times = random.Random(5), np.arange(40.0)
    seen = [
        0.05 + speed * PERIOD * n * math.cos(0.7) + rng.gauss(0.0, SIGMA) + 0.0 * rng.gauss(0.0, 1.0) for n in times
    ]
    slope, start = np.polyfit(times, seen, 1)
    assert track.values[1] * SIDES[0] == pytest.approx(start + slope * times[-1], abs=1e-7)


def test_what_jumps_begins_anew():
    track = TouchFilter(SIDES)
    for n in range(30):
        track.feed(matrix(0.05 + (0.02 if n == 29 else 0.0), 0.05), NOISE, PERIOD)
    assert track.frames == 1
    assert track.share == 1.0
    assert track.values[1] * SIDES[0] == pytest.approx(0.07)
