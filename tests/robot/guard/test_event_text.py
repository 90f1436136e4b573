"""Every event has a line for people."""

from typing import Any

import pytest

from coneskin.robot.guard.signals import event_text
from coneskin.robot.guard.signals.event_text import EventLines, describe
from coneskin.robot.guard.signals.journal import SESSION_EVENTS, EventName, GuardEvent
from tests.support.paths import ROOT

TOUCH = {"sensor": "skin", "link": "forearm", "u": 0.0701, "phi": 1.5708, "level": 0.6, "location_valid": True}
#: details as the guard gives them, and what a person reads
LINES: dict[str, tuple[dict[str, Any], str]] = {
    "waiting": ({"reasons": ["a is silent", "b is touched"]}, "waiting: a is silent; b is touched"),
    "activated": ({}, "activated"),
    "not_commissioned": ({"what": "no record"}, "not commissioned, the arm only stops: no record"),
    "contact": (TOUCH, "touch on skin (forearm) at u = 70.1 mm, phi = 90.0 deg; level 0.60"),
    "contact_located": (TOUCH, "touch located on skin (forearm) at u = 70.1 mm, phi = 90.0 deg; level 0.60"),
    "contact_extended": (
        {**TOUCH, "location_valid": False, "elongation": (0.04, 0.0)},
        "touch is not one disc on skin (forearm) at u = 70.1 mm, phi = 90.0 deg (several contacts, or a long one: "
        "half-length 40 mm, ratio unknown); level 0.60",
    ),
    "touch_ended": ({"sensor": "skin"}, "touch on skin ended"),
    "fault": ({"what": "skin: silent (51 ms)"}, "fault: skin: silent (51 ms)"),
    "stopping": ({"why": "touch"}, "stop: touch"),
    "decelerating": ({"speed": 0.81234}, "decelerating: 0.812 rad/s"),
    "standstill": (
        {"speed": 0.001, "paths": ["driver", "command"]},
        "standstill: 0.0010 rad/s; stop paths tried: driver, command",
    ),
    "escalated": ({"path": "command"}, "the stop is not confirmed: escalating to the command path"),
    "stop_failed": (
        {"rounds": 2, "speed": 0.25},
        "standstill NOT confirmed, 0.250 rad/s: all stop paths used 2 times; use the emergency stop",
    ),
    "retreating": ({}, "retreating"),
    "speed_reduced": ({"slider": 0.2, "before": 1.0}, "speed reduced: slider from 100 % to 20 %"),
    "speed_limited": (
        {"slider": 0.4, "before": 1.0, "sensor": "front", "ratio": 2.25},
        "speed limited: slider from 100 % to 40 %; front would move at 225 % of its permissible speed",
    ),
    "resumed": ({"slider": 1.0}, "no touch any more: speed slider back to 100 %"),
    "motion_limited": (
        {"by": ["joint speed", "singularity"]},
        "retreat slower than set, because of joint speed, singularity",
    ),
    "retreated": ({"progress": 0.05, "complete": True, "why": "distance"}, "retreated 50.0 mm: distance"),
    "latched": ({"why": "touch"}, "latched until a manual reset: touch"),
    "refused": ({"what": "reset", "reasons": ["it is touched", "x"]}, "reset refused: it is touched; x"),
    "reset": ({}, "reset"),
    "message": ({"what": "recording ended"}, "message: recording ended"),
    "ending": ({"what": "told to end"}, "ending: told to end"),
    **{name: ({"what": "no port"}, f"{name}: no port") for name in sorted(SESSION_EVENTS)},
}


def test_a_long_cause_is_said_in_full_once() -> None:
    cause, lines = "the skin is gone: the other end closed it; look at the plug", EventLines()
    said = [
        lines.describe(GuardEvent(name, 1.0, {key: words}), 0.0).partition("s  ")[2]
        for name, key, words in (
            (EventName.STOPPING, "why", cause),
            (EventName.FAULT, "what", cause),
            (EventName.FAULT, "what", "something else that is long enough"),
            (EventName.LATCHED, "why", f"{cause}; then the guard hung"),
            (EventName.STOPPING, "why", "touch"),
            (EventName.LATCHED, "why", "touch"),
        )
    ]
    assert said == [
        f"stop: {cause}",
        "fault: that has stopped the arm",
        "fault: something else that is long enough",
        "latched until a manual reset: as said above; then the guard hung",
        "stop: touch",
        "latched until a manual reset: touch",
    ]


def test_an_arm_that_stood_already_does_not_decelerate() -> None:
    assert describe(GuardEvent(EventName.DECELERATING, 1.0, {"speed": 1e-5}), 0.0).endswith("  the arm moves no more")


def test_every_event_has_its_line_here() -> None:
    assert set(LINES) == set(EventName)


def test_every_event_is_made_somewhere() -> None:
    files = [*ROOT.glob("robot/**/*.py"), *ROOT.glob("src/coneskin/session/*.py")]
    code = "".join(path.read_text(encoding="utf-8") for path in files if path.name != "journal.py")
    assert [name for name in EventName if f"EventName.{name.name}" not in code] == []


@pytest.mark.parametrize("name", LINES)
def test_its_line(name: str) -> None:
    details, words = LINES[name]
    assert describe(GuardEvent(EventName(name), 1001.25, details), 1000.0) == f"   1.2500 s  {words}"


def test_how_it_moves_away() -> None:
    assert describe(GuardEvent("retreating", 1.0, {"how": "push"}), 1.0).endswith("  giving way to the push")


@pytest.mark.parametrize(
    ("name", "details", "words"),
    [
        ("motion_limited", {"by": ["damping", "level"]}, "giving way slower than set, because of damping, level"),
        (
            "retreated",
            {"progress": -0.0128, "braking": 0.02, "why": "a touch"},
            "went 20.0 mm on while it braked and then 7.2 mm back: a touch",
        ),
        ("retreated", {"progress": 0.0395, "why": "the touch is over"}, "gave way 39.5 mm: the touch is over"),
        ("retreated", {"progress": 0.05, "why": "the distance is made", "how": "push"}, "gave way 50.0 mm: the dist"),
        (
            "latched",
            {"why": "the guard was told to end"},
            "the arm stands and the guard ends: the guard was told to end",
        ),
    ],
)
def test_what_is_no_retreat_is_not_called_one(name: str, details: dict[str, Any], words: str) -> None:
    assert describe(GuardEvent(name, 1.0, details), 1.0).startswith(f"   0.0000 s  {words}")


def test_the_words_are_those_of_the_robot() -> None:
    assert event_text._END_CAUSE in (ROOT / "robot" / "guard" / "loop.py").read_text(encoding="utf-8")
    comply = (ROOT / "robot" / "reaction" / "motion_choice.py").read_text(encoding="utf-8")
    assert all(f'"{word}"' in comply for word in (event_text._RELEASE_CAUSE, *event_text._PUSH_LIMITS))
    others = [path for path in (ROOT / "robot").rglob("*.py") if path.name not in ("motion_choice.py", "event_text.py")]
    assert not [path.name for path in others if event_text._RELEASE_CAUSE in path.read_text(encoding="utf-8")]


ELLIPSE = {"ellipse": ((0.0, 3e-4, 4e-4), (0.0, 1e-5, 0.0))}


@pytest.mark.parametrize(
    ("known", "words"),
    [
        (ELLIPSE, "phi = 90.0 deg, +- 0.5 mm; level 0.60"),
        ({"ellipse": ((0.0, 1e-6, 0.0), (0.0, 0.0, 0.0))}, "phi = 90.0 deg, +- 0.1 mm; level 0.60"),
        ({"location_valid": False}, "phi = 90.0 deg (not certain yet); level 0.60"),
        (
            {"location_valid": False, **ELLIPSE},
            "phi = 90.0 deg (not certain yet; +- 0.5 mm if it is one contact); level 0.60",
        ),
        (
            {"location_valid": False, **ELLIPSE, "elongation": (0.0212, 0.4)},
            "phi = 90.0 deg (several contacts, or a long one: half-length 21 mm, ratio unknown); level 0.60",
        ),
    ],
)
def test_how_certain_a_place_is(known: dict[str, Any], words: str) -> None:
    assert describe(GuardEvent("contact", 0.0, {**TOUCH, **known}), 0.0).endswith(words)
