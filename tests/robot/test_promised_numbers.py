"""Numbers of docs/safety.md, and of pages that it names: each stands there as the code has it."""

import inspect
import math
import re

import pytest

from coneskin.impact.permissible_speed.extra_way import BODY_RADIUS
from coneskin.impact.permissible_speed.speed_map import _POSITION_COUNT, _SAMPLING_FACTOR
from coneskin.impact.permissible_speed.taylor_integrator import HORIZON
from coneskin.impact.permissible_speed.two_mass_contact import _CLOSING_FORCE
from coneskin.impact.simulation.scene_description import SERVO_FREQUENCY
from coneskin.robot.driver.liveness import GUARD_SILENCE, HOLD_UP_LIMIT, SETPOINT_SILENCE, UNGUARDED_TIME
from coneskin.robot.guard.activation import _RELEASE_TIMEOUT
from coneskin.robot.guard.arm_supervisor import _PLACE_TIME
from coneskin.robot.guard.companion_monitor import _RESTART_TIMEOUT
from coneskin.robot.guard.loop import _SUSPENSION_TIME
from coneskin.robot.guard.motion.setpoint_stream import _MAX_APPROACH, _MAX_DEVIATION_TIME, _MAX_OVERSPEED
from coneskin.robot.guard.speed.speed_limit import _FALL_TIME, _HOLD_TIME, _MAX_HOLD_TIME, _SLIDER_LEAD
from coneskin.robot.guard.speed.speed_reduction import CLEAR_TIME
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.standstill import _MAX_DRIFT, _MAX_SPEED, _MAX_STARTS, _MAX_TOUCHED_DRIFT, WATCH_DURATION
from coneskin.robot.stop.state_age import _LAG_TIME, _OFFSET_WINDOW, MAX_SUPERVISION_LAG
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES
from coneskin.scene.commissioning_record import MAX_MISS, MIN_MARKS
from coneskin.session.arm_client import ArmClient
from coneskin.session.ur_rtde_names import _SERVO_HOLD_TIME, _SPEED_HOLD_TIME
from tests.support.paths import ROOT


def text_of(page: str) -> str:
    return " ".join((ROOT / "docs" / page).read_text(encoding="utf-8").split())


PROMISES = dict(re.findall(r"\| (P\d+) \| (.*?) \|", text_of("safety.md")))
LIMITS, RETREAT = MonitoringLimits(), Reaction("retreat")
TENTHS = {1.1: "a tenth"}
WORDS = {3: "three", 5: "five"}


@pytest.mark.parametrize(
    ("promise", "said"),
    [
        ("P02", f"waits {_PLACE_TIME:g} s at most for the place"),
        ("P15", f"where they are {1e3 * MAX_SUPERVISION_LAG:g} ms late for {1e3 * _LAG_TIME:g} ms"),
        ("P15", f"one that grows over more than {_OFFSET_WINDOW:g} s"),
        ("P20", f"this happens only after {_RESTART_TIMEOUT:g} s"),
        ("P22", f"{WORDS[STANDSTILL_SAMPLES]} samples in a row ({2 * STANDSTILL_SAMPLES} ms) below"),
        ("P22", f"it takes {WATCH_DURATION:g} s in which nothing moved it"),
        ("P26", f"above {_MAX_SPEED:g} rad/s or {_MAX_DRIFT:g} rad, and while"),
        ("P26", f"or {_MAX_TOUCHED_DRIFT:g} rad in all joints together"),
        ("P27", f"where programs start {WORDS[_MAX_STARTS]} times within one watch"),
        ("P30", f"faster by {_MAX_OVERSPEED:g} rad/s (10 ms) or comes {1e3 * _MAX_APPROACH:g} mm nearer"),
        ("P30", f"else after {_MAX_DEVIATION_TIME:g} s and the time"),
        ("P34", f"`arm_distance_mm` ({1e3 * RETREAT.arm_distance:g})"),
        ("P34", f"or faster than {1e3 * RETREAT.arm_speed:g} mm/s"),
        ("P40", f"({LIMITS.process_silence:g} s), or for {HOLD_UP_LIMIT:g} s while it waits"),
        ("P42", f"sends no heartbeat for {GUARD_SILENCE:g} s, the driver process"),
        ("P42", f"or silent for {UNGUARDED_TIME:g} s, and your program"),
        ("P43", f"the driver process stops the arm after {SETPOINT_SILENCE:g} s"),
        ("P50", f"`program_silence_ms` ({LIMITS.program_silence:g} s)"),
        ("P51", f"`duration` ({_SPEED_HOLD_TIME:g} s; {_SERVO_HOLD_TIME:g} s)"),
        ("P59", f"frozen, for {_SUSPENSION_TIME:g} s or longer"),
        ("P64", f"within {_RELEASE_TIMEOUT:g} s"),
    ],
)
def test_a_number_of_a_promise_is_the_one_that_counts(promise: str, said: str) -> None:
    assert said in PROMISES[promise]


def test_what_a_record_shows_is_what_is_asked_for() -> None:
    said = (
        f"within {1e3 * MAX_MISS[0]:g} mm and {math.degrees(MAX_MISS[1]):g} deg, at {WORDS[MIN_MARKS]} places or more"
    )
    assert said in text_of("safety.md")


@pytest.mark.parametrize(
    ("names", "hold"), [(("speed_j", "speed_l"), _SPEED_HOLD_TIME), (("servo_j", "servo_l"), _SERVO_HOLD_TIME)]
)
def test_a_command_holds_for_as_long_under_both_names(names: tuple[str, ...], hold: float) -> None:
    for name in names:
        assert inspect.signature(getattr(ArmClient, name)).parameters["duration"].default == hold


@pytest.mark.parametrize(
    "said",
    [
        f"after the layers have closed ({_CLOSING_FORCE:g} N)",
        f"{SERVO_FREQUENCY:g} Hz at the joints",
        f"on a ball of {1e3 * BODY_RADIUS:g} mm",
        f"{TENTHS.get(_SAMPLING_FACTOR)} more than the most of {_POSITION_COUNT} random positions",
        f"of the peak within {HORIZON:g} s",
        f"{1e3 * _SLIDER_LEAD:g} ms ahead on its way",
        f"goes up again after {_HOLD_TIME:g} s of motion",
        f"up to {_MAX_HOLD_TIME:g} s. So it comes to rest",
        f"no effect within {_FALL_TIME:g} s, or the arm is still too fast after {3.0 * _FALL_TIME:g} s",
    ],
)
def test_permissible_speeds_are_kept_as_their_page_says(said: str) -> None:
    assert said in text_of("do/permissible-speed.md")


def test_a_slow_reaction_lasts_half_a_second_longer_than_its_touch() -> None:
    said = {0.5: "while the touch lasts, and half a second longer"}[CLEAR_TIME]
    assert said in text_of("look-up/scene.md")
