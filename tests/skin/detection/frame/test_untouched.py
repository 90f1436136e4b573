"""Leak between the layers: what it does to the place of a touch, and what is left of that once it is learned."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameInversion
from coneskin.skin.detection.frame.untouched import LEAK_BLOCK, UntouchedLeak
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame

FOREARM = Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350)))


def frames_of(*touches: ScriptedTouch, leak: float, seed: int = 0, duration: float = 0.3) -> list[Frame]:
    damp = Imperfections(leak=leak, noise_counts=0.7)
    skin = VirtualSkin(FOREARM, touches, imperfections=damp, seed=seed, duration=duration, model="ladder")
    return [frame for _, frame in skin.frames()]


def learned(leak: float, blocks: int = 8) -> UntouchedLeak:
    found = UntouchedLeak(FOREARM, 1e-4)
    for frame in frames_of(leak=leak, duration=blocks * LEAK_BLOCK * 1e-3):
        found.feed(frame, (frame.touch_c + frame.touch_d) / (2.0 * frame.touch_supply))
    return found


def centre_of(frames: list[Frame]) -> ContactMatrix:
    """The matrix of the mean of some frames."""
    sums = [sum(counts) / len(frames) for counts in zip(*[frame[6:18] for frame in frames], strict=True)]
    matrix = FrameInversion(FOREARM).invert(sums)
    assert matrix is not None
    return matrix


def error_mm(matrix: ContactMatrix, u: float, phi: float) -> float:
    found_u, found_phi = FOREARM.place(1.0 - matrix.x, matrix.y)
    return 1e3 * math.hypot(found_u - u, 0.0375 * (found_phi - phi))


def test_a_leak_is_learned_with_its_centre():
    found = learned(1e-5)
    assert found.conductance == pytest.approx(1e-5, rel=0.02)
    assert (found.x, found.y) == pytest.approx((0.5, 0.5), abs=0.005)
    assert learned(0.0).conductance < 1e-7


@pytest.mark.long
def test_a_leak_of_100_kohm_moves_no_touch():
    """decode.md: 2.6 mm become at most .3, at light and firm presses all over the sensor; the mean of 100 frames."""
    leak, rng = learned(1e-5), random.Random(2)
    before, after = [], []
    for number in range(12):
        u, phi = rng.uniform(0.02, 0.22), rng.uniform(0.3, 5.8)
        touch = ScriptedTouch(0.0, 9.0, u, phi, force=rng.choice([1.2, 2.0, 5.0, 20.0]))
        own = centre_of(frames_of(touch, leak=0.0, seed=number)[200:])
        u, phi = FOREARM.place(1.0 - own.x, own.y)  # where it is read without a leak
        whole = centre_of(frames_of(touch, leak=1e-5, seed=99 + number)[200:])
        before.append(error_mm(whole, u, phi))
        after.append(error_mm(leak.take_off(whole), u, phi))
        assert leak.take_off(whole).conductance == pytest.approx(own.conductance, rel=0.01)
    assert max(before) > 1.0
    assert max(after) < 0.3


def test_what_is_left_of_two_contacts_is_the_second():
    """Moments of point contacts add exactly: the parallel axis of leak and touch is taken off the polarisability."""
    leak = UntouchedLeak(FOREARM, 1e-4)
    leak.conductance, leak.x, leak.y = 2e-5, 0.5, 0.4
    touch, x, y = 1e-4, 0.8, 0.1
    whole = touch + leak.conductance
    part = touch * leak.conductance / whole
    matrix = ContactMatrix(
        whole,
        (touch * x + leak.conductance * leak.x) / whole,
        (touch * y + leak.conductance * leak.y) / whole,
        1e-3 + part * (x - leak.x) ** 2,
        part * (x - leak.x) * (y - leak.y),
        1e-3 + part * (y - leak.y) ** 2,
        0.0,
        0.0,
        0.0,
    )
    left = leak.take_off(matrix)
    assert left[:6] == pytest.approx((touch, x, y, 1e-3, 0.0, 1e-3), rel=1e-12, abs=1e-18)


def test_a_touch_that_is_hardly_more_than_the_leak_stays_as_it_is():
    leak = UntouchedLeak(FOREARM, 1e-4)
    leak.conductance, leak.x, leak.y = 2e-5, 0.5, 0.5
    weak = ContactMatrix(3e-5, 0.9, 0.9, 1e-3, 0.0, 1e-3, 0.0, 0.0, 0.0)
    assert leak.take_off(weak) is weak


def test_no_more_than_the_largest_leak_is_ever_taken_off():
    found = UntouchedLeak(FOREARM, 5e-6)
    for frame in frames_of(leak=5e-5):
        found.feed(frame, (frame.touch_c + frame.touch_d) / (2.0 * frame.touch_supply))
    assert found.conductance == pytest.approx(5e-6, rel=1e-9)
