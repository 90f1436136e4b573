"""None"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coneskin.impact.simulation.collision_run import follow_waypoints
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.driver.values import ControllerState, SetSpeedSlider
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.guard.speed.permissible_speeds import PermissiblePatch, PermissibleSpeeds, SurfaceSpeeds
from coneskin.robot.guard.speed.speed_limit import SpeedLimit, _SliderSetting
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.sim.mock_arm import MockArm
from coneskin.robot.ur.driver import UR_DRIVER
from tests.support.guard_rig import CONE, LINK, MODEL, START_Q, GuardRig, touch


def test_what_is_read_late_is_not_a_persons_doing() -> None:
    setting = _SliderSetting()
    assert not setting.feed(0.0, 1.0)
    setting.set(0.0, 0.6, 1.0)
    setting.set(0.06, 0.5, 1.0)
    for now, read in ((0.07, 1.0), (0.08, 0.6), (0.1, 0.6), (0.12, 0.5), (9.0, 0.5)):
        assert not setting.feed(now, read)
    assert (setting.ceiling, setting.fraction, setting.shown) == (1.0, 0.5, True)


@pytest.mark.parametrize("read", [0.0, 0.3, 0.489, 0.511, 0.8, 1.0])
def test_once_the_setting_was_read_anything_else_is_a_persons_doing(read: float) -> None:
    setting = _SliderSetting()
    setting.feed(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    setting.feed(0.02, 0.5)
    assert not setting.feed(0.03, 0.491)  # the slider is read to a hundredth
    assert not setting.feed(0.03, 0.509)
    assert setting.feed(0.04, read)
    assert (setting.ceiling, setting.fraction) == (read, None)


def test_a_slider_that_never_follows_is_a_persons_doing() -> None:
    setting = _SliderSetting()
    setting.feed(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    assert not setting.feed(0.5, 1.0)
    assert setting.feed(0.6, 1.0)


def test_a_value_that_was_passed_does_not_come_back_by_itself() -> None:
    setting = _SliderSetting()
    setting.feed(0.0, 1.0)
    setting.set(0.0, 0.7, 1.0)
    setting.set(0.1, 0.5, 1.0)
    assert not setting.feed(0.12, 0.7)
    assert setting.feed(0.14, 1.0)
    assert setting.ceiling == 1.0


def test_a_stop_by_the_slider_does_not_become_a_persons_zero() -> None:
    setting = _SliderSetting()
    setting.feed(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    setting.feed(0.1, 0.5)
    setting.resume()  # put back from 0 after a person's reset
    assert not setting.feed(30.0, 0.0)
    assert not setting.feed(30.02, 0.5)
    assert (setting.ceiling, setting.fraction) == (1.0, 0.5)
    setting.resume()  # after a stop that did not need the slider
    assert not setting.feed(60.0, 0.5)


LEVERS = (0.1, 0.2, 0.4, 0.8)
CURVE = (0.05, 0.1, 0.2, 0.3)  # up to 0.4 m/rad: 0.5 rad/s of the leading joint
SLOW = tuple(0.5 * speed for speed in CURVE)
PATCHES = tuple(
    PermissiblePatch("front", LINK, CONE.point(u, phi), CONE.normal(phi), CURVE, SLOW)
    for u in (0.0, 0.13, 0.26)
    for phi in [math.pi * n / 4 for n in range(8)]
)
ANYWHERE = PermissibleSpeeds(LEVERS, PATCHES, (-7.0,) * 6, (7.0,) * 6)
RING = replace(ANYWHERE, patches=PATCHES[:8])  # of which the fastest is as fast, where the base turns alone


class Loop:
    """An arm whose program turns the base, under a limit; a state each 2 ms, the slider is read each 20 ms."""

    def __init__(self, speeds: PermissibleSpeeds = RING, heeds: bool = True) -> None:
        self.limit = SpeedLimit(MODEL, speeds)
        self.surfaces = SurfaceSpeeds(MODEL, speeds)
        self.arm = MockArm(list(START_Q), [0.0] * 6, heeds=heeds)
        self.events: list[GuardEvent] = []
        self.now, self.why = 100.0, ""
        self.fastest: dict[float, ControllerState] = {}
        self.slider: float | None = 1.0
        self.steps, self.waiting = 0, list[tuple[int, SetSpeedSlider]]()

    def run(self, seconds: float, speed: float, acceleration: float = 2.0, late: int = 10) -> Loop:
        """Let the program move the arm; a command arrives some states late."""
        self.arm.go([speed, 0, 0, 0, 0, 0], acceleration)
        for _ in range(round(seconds / 0.002)):
            self.step(late)
            if self.why:
                break
        return self

    def step(self, late: int = 10) -> None:
        """Let one state come."""
        self.now += 0.002
        self.steps += 1
        while self.waiting and self.waiting[0][0] <= self.steps:
            self.arm.feed(self.waiting.pop(0)[1])
        if self.steps % 10 == 0 and self.slider is not None:
            self.slider = self.arm.slider
        state = UR_DRIVER.decode_state(self.now, self.arm.poll())
        way = math.copysign(1.0, state.qd[0])
        if way not in self.fastest or state.speed > self.fastest[way].speed:
            self.fastest[way] = state
        out: list[object] = []
        self.why = self.limit.sample(state, self.slider, out)  # type: ignore[arg-type]
        self.waiting += [(self.steps + late, item) for item in out if isinstance(item, SetSpeedSlider)]
        self.events += [item for item in out if isinstance(item, GuardEvent)]

    @property
    def top(self) -> float:
        """Highest speed over what is permissible: of a turning base, all else at rest, it grows with the speed."""
        return max((self.surfaces.ratio(state.q, state.qd)[0] for state in self.fastest.values()), default=0.0)

    def stroke(self, angle: float, speed: float, acceleration: float) -> Loop:
        """Let the program turn the base to an angle from where it began [rad]."""
        program = follow_waypoints([[START_Q[0] + angle, *START_Q[1:]]], speed, acceleration)
        while not self.why and (wanted := program(self.arm.q)) is not None:
            self.arm.go(*wanted)
            self.step()
        return self


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6), st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
@example([0.0] * 6, [0.0, 0.0, 1.192092896e-07, 0.0, 0.0, 1.0])
def test_the_ratio_is_that_of_the_jacobian(q: list[float], qd: list[float]) -> None:
    leading = max(map(abs, qd))
    worst = 0.0
    for patch in PATCHES:
        rows = point_jacobian(MODEL, q, LINK, patch.point)
        normal = link_pose(MODEL, q, LINK).rotate(patch.normal)
        speed = sum(n * sum(j * v for j, v in zip(row, qd, strict=True)) for n, row in zip(normal, rows, strict=True))
        if speed > 0.0:
            lever = min(speed / leading, 0.8)
            points = zip((0.0, *LEVERS), (0.0, *CURVE), LEVERS, CURVE, strict=False)
            allowed = next(a + (b - a) * (lever - x) / (y - x) for x, a, y, b in points if lever <= y)
            worst = max(worst, speed / max(1e-6, allowed))  # m/s; slower it cannot be told from standing
    found, _ = SurfaceSpeeds(MODEL, ANYWHERE).ratio(q, qd)
    assert found == pytest.approx(worst, rel=1e-6, abs=1e-6)


@pytest.mark.long
def test_a_program_that_asks_for_too_much_is_slowed_before_it_is_too_fast() -> None:
    loop = Loop().run(2.0, speed=1.0)
    assert loop.why == ""
    assert [event.name for event in loop.events][:1] == [EventName.SPEED_LIMITED]
    assert loop.top <= 1.05  # of what is permissible
    loop.run(4.0, speed=1.0)
    assert 0.6 < loop.surfaces.ratio(loop.arm.q, loop.arm.qd)[0] <= 1.0  # and not slower than it need be
    assert loop.arm.slider < 0.6


def test_what_is_slow_enough_is_let_be() -> None:
    loop = Loop().run(1.0, speed=0.35)
    assert loop.why == ""
    assert not loop.events
    assert loop.arm.slider == 1.0


def test_what_does_not_obey_the_slider_is_stopped() -> None:
    loop = Loop(heeds=False).run(3.0, speed=1.0)
    assert "has no effect" in loop.why
    limited = next(event.time for event in loop.events if event.name == EventName.SPEED_LIMITED)
    assert loop.now - limited == pytest.approx(0.9, abs=0.01), "it was still speeding up: three times its patience"
    loop = Loop(heeds=False).run(1.0, speed=0.4)
    loop.limit, since = SpeedLimit(MODEL, replace(ANYWHERE, lowest=(), highest=())), loop.now
    assert "has no effect" in loop.run(1.0, speed=0.4).why
    assert loop.now - since == pytest.approx(0.3, abs=0.01), "at a steady speed"


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


@pytest.mark.parametrize(("speed", "moves"), [(0.0, False), (0.018, False), (0.025, True)])
@pytest.mark.long
def test_a_standing_arm_keeps_the_slider_where_it_is(speed: float, moves: bool) -> None:
    """Otherwise each start of a program would begin too fast. Below 0.02 rad/s it stands."""
    loop = Loop().run(1.0, speed=1.0)
    low = loop.arm.slider
    loop.run(3.5, speed=speed / low)
    assert (loop.arm.slider > low) is moves
    assert loop.why == ""


def test_a_slider_that_a_person_puts_up_again_is_put_down_again() -> None:
    loop = Loop().run(1.5, speed=1.0)
    loop.arm.slider = 1.0
    loop.run(2.0, speed=1.0)
    assert loop.why == ""
    assert loop.surfaces.ratio(loop.arm.q, loop.arm.qd)[0] <= 1.0


def test_outside_the_positions_of_the_motion_the_slower_speeds_hold() -> None:
    beside = replace(ANYWHERE, lowest=(3.0,) * 6, highest=(4.0,) * 6)
    q, qd = START_Q, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    inside = SurfaceSpeeds(MODEL, ANYWHERE).ratio(q, qd)[0]
    assert SurfaceSpeeds(MODEL, beside).ratio(q, qd)[0] == pytest.approx(2.0 * inside)
    assert SurfaceSpeeds(MODEL, replace(ANYWHERE, lowest=(), highest=())).ratio(q, qd)[0] == pytest.approx(2.0 * inside)


def test_a_standing_arm_has_no_ratio() -> None:
    assert SurfaceSpeeds(MODEL, ANYWHERE).ratio(START_Q, (0.0,) * 6) == (0.0, "")


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
    assert loop.arm.slider <= ceiling
    loop.run(9.0, speed=1.0)
    assert loop.why == ""
    assert 0.9 * ceiling < loop.arm.slider <= ceiling


def test_a_slider_at_zero_beside_a_moving_arm_does_not_end_the_guard() -> None:
    loop = Loop(heeds=False)
    limit, out = loop.limit, []  # type: ignore[var-annotated]
    state = UR_DRIVER.decode_state(100.0, loop.arm.poll())
    limit.sample(state._replace(qd=(50.0, 0, 0, 0, 0, 0)), 1.0, out)
    assert out[0] == SetSpeedSlider(0.01)
    assert limit.sample(state._replace(time=101.0, qd=(0.1, 0, 0, 0, 0, 0)), 0.0, out) == ""


@pytest.mark.long
@pytest.mark.parametrize(
    ("angle", "there", "back", "acceleration"),
    [(0.35, 1.0, 1.0, 8.0), (1.2, 1.4, 0.7, 3.0), (0.8, 2.0, 1.0, 20.0)],
)
def test_the_slider_comes_to_rest_where_a_program_repeats_itself(
    angle: float, there: float, back: float, acceleration: float
) -> None:
    """It went down at each start, as if the arm sped up for ever, and up again at each end: 3 to 12 times a stroke."""
    loop = Loop()
    for _ in range(4 if acceleration < 10.0 else 12):
        loop.stroke(angle, there, acceleration).stroke(0.0, back, acceleration)
    settled = len(loop.events)
    assert 1 <= settled <= 9
    assert loop.top < (1.1 if acceleration < 10.0 else 1.3)  # the hardest start is faster than the slider
    loop.fastest = {}
    for _ in range(4):
        loop.stroke(angle, there, acceleration).stroke(0.0, back, acceleration)
    assert loop.why == ""
    assert len(loop.events) == settled
    assert 0.7 < loop.top <= 1.0  # of what is permissible: not slower than it need be


@pytest.mark.long
def test_a_program_with_slow_and_fast_parts_moves_the_slider_ever_more_rarely() -> None:
    """The wait doubles at each mistake, so that the mistakes of a time grow as its logarithm."""
    loop = Loop()
    downs = []
    for _ in range(9):
        before = loop.arm.slider
        loop.stroke(0.6, 1.6, 8.0)
        downs += [loop.now] if loop.arm.slider < 0.95 * before else []
        loop.stroke(0.0, 0.5, 8.0)
        loop.run(1.0, speed=0.0)
        assert loop.why == ""
    assert 1 <= len(downs) <= 4
    assert loop.top < 1.1


def test_a_person_who_raises_the_slider_right_after_the_guard_is_heard() -> None:
    """For 0.5 s what was read above the guard's setting was taken for what the slider had not yet left."""
    loop = Loop().run(0.5, speed=1.0)
    while not loop.events or loop.now - loop.events[-1].time < 0.2:
        loop.run(0.02, speed=1.0)
    assert loop.now - loop.events[-1].time < 0.45
    loop.arm.slider = 0.8
    loop.run(0.03, speed=0.0, acceleration=100.0)
    assert loop.limit.setting.ceiling == 0.8


def test_at_its_end_the_slider_is_where_it_was_found() -> None:
    loop = Loop()
    loop.arm.slider = loop.slider = 0.9
    loop.run(2.0, speed=1.4)
    out: list[object] = []
    loop.limit.end(loop.now, loop.slider, out)  # type: ignore[arg-type]
    assert out[0] == SetSpeedSlider(0.9)
    assert isinstance(out[1], GuardEvent)
    loop.limit.end(loop.now, loop.slider, out)  # type: ignore[arg-type]
    assert len(out) == 2  # once


@pytest.mark.parametrize("slider", [0.0, 0.35, 0.7, None])
@pytest.mark.long
def test_at_its_end_a_slider_that_something_else_has_moved_stays_there(slider: float | None) -> None:
    loop = Loop().run(2.0, speed=1.0)
    assert 0.1 < loop.arm.slider < 0.3
    out: list[object] = []
    loop.limit.end(loop.now, slider, out)  # type: ignore[arg-type]
    assert out == []


def test_a_setting_that_crosses_a_persons_on_its_way_is_taken_back() -> None:
    """It was read 20 ms after the person's, and taken for the person's wish."""
    loop = Loop().run(0.5, speed=1.0)
    loop.limit.setting.set(loop.now, 0.6, loop.arm.slider)
    loop.arm.slider = loop.slider = 0.05
    loop.run(0.01, speed=0.1)
    assert loop.limit.setting.ceiling == 0.05
    loop.arm.slider = loop.slider = 0.6  # only now does it arrive
    loop.run(0.06, speed=0.1)
    assert loop.arm.slider == 0.05
    assert loop.limit.setting.ceiling == 0.05


@pytest.mark.long
@pytest.mark.parametrize("touched", [False, True])
def test_a_guard_that_ends_puts_the_slider_back_once_the_arm_stands(touched: bool) -> None:
    touches = [touch(1.0, 1.1)] if touched else []
    rig = GuardRig(*touches, reaction=Reaction(kind="stop"), speed=1.0, speed_limit=SpeedLimit(MODEL, ANYWHERE))
    rig.arm.slider = 0.9
    rig.run(1.6)
    assert rig.core.phase is (Phase.LATCHED if touched else Phase.ACTIVE)
    assert rig.arm.slider < 0.5
    rig.feed(BlockKind.LOST, b"session\nthe guard was told to end")
    assert (rig.arm.slider == 0.9) is touched  # it stands already
    while rig.core.phase is not Phase.LATCHED:
        assert rig.arm.slider < 0.5
        rig.run(0.001)
    assert rig.arm.speed < 0.02
    assert rig.arm.slider == 0.9
