from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.driver.setpoint import SetSpeedSlider
from coneskin.robot.guard.journal import EventName, GuardEvent
from coneskin.robot.guard.speed_limit import PermissiblePatch, PermissibleSpeeds, SpeedLimit
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.testing.guard_rig import CONE, LINK, MODEL, START_Q
from coneskin.testing.mock_arm import MockArm

LEVERS = (0.1, 0.2, 0.4, 0.8)
CURVE = (0.05, 0.1, 0.2, 0.3)  # up to 0.4 m/rad: 0.5 rad/s of the leading joint
SLOW = tuple(0.5 * speed for speed in CURVE)
PATCHES = tuple(
    PermissiblePatch("front", LINK, CONE.point(u, phi), CONE.normal(phi), CURVE, SLOW)
    for u in (0.0, 0.13, 0.26)
    for phi in [math.pi * n / 8 for n in range(16)]
)
ANYWHERE = PermissibleSpeeds(LEVERS, PATCHES, (-7.0,) * 6, (7.0,) * 6)


class Loop:
    """An arm whose program turns the base, under a limit; a state each 2 ms, the slider is read each 20 ms."""

    def __init__(self, speeds: PermissibleSpeeds = ANYWHERE, heeds: bool = True) -> None:
        self.limit = SpeedLimit(MODEL, speeds)
        self.arm = MockArm(list(START_Q), [0.0] * 6, heeds=heeds)
        self.events: list[GuardEvent] = []
        self.now, self.why, self.top = 100.0, "", 0.0
        self.slider: float | None = 1.0

    def run(self, seconds: float, speed: float, acceleration: float = 2.0, late: int = 10) -> Loop:
        """Let the program move the arm; a command arrives some states late."""
        waiting: list[tuple[int, SetSpeedSlider]] = []
        self.arm.go([speed, 0, 0, 0, 0, 0], acceleration)
        for step in range(round(seconds / 0.002)):
            self.now += 0.002
            while waiting and waiting[0][0] <= step:
                self.arm.take(waiting.pop(0)[1])
            if step % 10 == 0 and self.slider is not None:
                self.slider = self.arm.slider
            state = UR_DRIVER.decode_state(self.now, self.arm.step())
            self.top = max(self.top, self.limit.ratio(state.q, state.qd)[0])
            out: list[object] = []
            self.why = self.limit.sample(state, self.slider, out)  # type: ignore[arg-type]
            waiting += [(step + late, item) for item in out if isinstance(item, SetSpeedSlider)]
            self.events += [item for item in out if isinstance(item, GuardEvent)]
            if self.why:
                break
        return self


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6), st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_the_ratio_is_that_of_the_jacobian(q: list[float], qd: list[float]) -> None:
    leading = max(map(abs, qd))
    worst = 0.0
    for patch in PATCHES:
        rows = point_jacobian(MODEL, q, LINK, patch.point)
        normal = link_pose(MODEL, q, LINK).rotate(patch.normal)
        speed = sum(n * sum(j * v for j, v in zip(row, qd, strict=True)) for n, row in zip(normal, rows, strict=True))
        if speed > 1e-9:
            lever = min(speed / leading, 0.8)
            points = zip((0.0, *LEVERS), (0.0, *CURVE), LEVERS, CURVE, strict=False)
            allowed = next(a + (b - a) * (lever - x) / (y - x) for x, a, y, b in points if lever <= y)
            worst = max(worst, speed / allowed)
    found, _ = SpeedLimit(MODEL, ANYWHERE).ratio(q, qd)
    assert found == pytest.approx(worst, rel=1e-6, abs=1e-6)


def test_a_program_that_asks_for_too_much_is_slowed_before_it_is_too_fast() -> None:
    loop = Loop().run(2.0, speed=1.0)
    assert loop.why == ""
    assert [event.name for event in loop.events][:1] == [EventName.SPEED_LIMITED]
    assert loop.top <= 1.05  # of what is permissible
    loop.run(4.0, speed=1.0)
    assert 0.6 < loop.limit.ratio(loop.arm.q, loop.arm.qd)[0] <= 1.0  # and not slower than it need be
    assert loop.arm.slider < 0.6


def test_what_is_slow_enough_is_let_be() -> None:
    loop = Loop().run(1.0, speed=0.35)
    assert loop.why == ""
    assert not loop.events
    assert loop.arm.slider == 1.0


def test_what_does_not_obey_the_slider_is_stopped() -> None:
    loop = Loop(heeds=False).run(3.0, speed=1.0)
    assert "has no effect" in loop.why
    assert loop.now < 101.2


def test_without_a_known_slider_too_fast_an_arm_is_stopped_at_once() -> None:
    loop = Loop()
    loop.slider = None
    loop.run(1.0, speed=1.0)
    assert "is not known" in loop.why
    assert loop.top <= 1.0  # foreseen


@pytest.mark.long
def test_the_slider_goes_up_again_after_a_while_of_slower_motion_but_not_beyond_a_persons_setting() -> None:
    loop = Loop().run(1.0, speed=1.0)
    low = loop.arm.slider
    loop.run(6.0, speed=0.3)
    assert loop.arm.slider > 1.5 * low
    assert loop.arm.slider <= 1.0
    assert loop.why == ""
    other = Loop()
    other.arm.slider = other.slider = 0.7
    other.run(1.0, speed=1.4).run(8.0, speed=0.3)
    assert other.arm.slider == pytest.approx(0.7)


def test_a_standing_arm_keeps_the_slider_where_it_is() -> None:
    """Otherwise each start of a program would begin too fast."""
    loop = Loop().run(1.0, speed=1.0)
    low = loop.arm.slider
    loop.run(4.0, speed=0.0)
    assert loop.arm.slider == low


def test_a_slider_that_a_person_puts_up_again_is_put_down_again() -> None:
    loop = Loop().run(1.5, speed=1.0)
    loop.arm.slider = 1.0
    loop.run(2.0, speed=1.0)
    assert loop.why == ""
    assert loop.limit.ratio(loop.arm.q, loop.arm.qd)[0] <= 1.0


def test_outside_the_positions_of_the_motion_the_slower_speeds_hold() -> None:
    beside = replace(ANYWHERE, lowest=(3.0,) * 6, highest=(4.0,) * 6)
    q, qd = START_Q, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    inside = SpeedLimit(MODEL, ANYWHERE).ratio(q, qd)[0]
    assert SpeedLimit(MODEL, beside).ratio(q, qd)[0] == pytest.approx(2.0 * inside)
    assert SpeedLimit(MODEL, replace(ANYWHERE, lowest=(), highest=())).ratio(q, qd)[0] == pytest.approx(2.0 * inside)


def test_a_standing_arm_has_no_ratio() -> None:
    assert SpeedLimit(MODEL, ANYWHERE).ratio(START_Q, (0.0,) * 6) == (0.0, "")


def test_short_strokes_that_do_not_obey_the_slider_are_stopped() -> None:
    """Each ends before its patience does, and the next one began with a new one: for ever at 480 %."""
    loop = Loop(heeds=False)
    for _ in range(20):
        if not loop.run(0.15, speed=1.2, acceleration=20.0).why:
            loop.run(0.1, speed=0.0, acceleration=20.0)
    assert "faster than the speed slider allows" in loop.why
    assert loop.now < 103.0


def test_short_strokes_that_obey_are_slowed_and_go_on() -> None:
    loop = Loop()
    for _ in range(12):
        loop.run(0.15, speed=2.0, acceleration=20.0).run(0.1, speed=0.0, acceleration=20.0)
    assert loop.why == ""


@pytest.mark.long
def test_a_persons_setting_right_after_the_guards_own_is_not_exceeded_later() -> None:
    """It was taken for the guard's own, and passed 2 s of slow motion later."""
    loop = Loop().run(0.3, speed=1.0)
    loop.arm.slider = 0.5 * loop.arm.slider
    ceiling = loop.arm.slider
    loop.run(0.1, speed=8.0, acceleration=40.0)
    assert loop.arm.slider < ceiling  # still too much, and the guard went below the person
    loop.run(5.0, speed=1.0)
    assert loop.why == ""
    assert 0.9 * ceiling < loop.arm.slider <= ceiling


def test_a_slider_at_zero_beside_a_moving_arm_does_not_end_the_guard() -> None:
    loop = Loop(heeds=False)
    limit, out = loop.limit, []  # type: ignore[var-annotated]
    state = UR_DRIVER.decode_state(100.0, loop.arm.step())
    limit.sample(state._replace(qd=(50.0, 0, 0, 0, 0, 0)), 1.0, out)
    assert out[0] == SetSpeedSlider(0.01)
    assert limit.sample(state._replace(time=101.0, qd=(0.1, 0, 0, 0, 0, 0)), 0.0, out) == ""
