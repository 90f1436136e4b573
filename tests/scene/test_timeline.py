"""Every event has a line for people."""

import ast
import re
from pathlib import Path
from typing import Any

import pytest

from coneskin import timeline
from coneskin.robot.journal import ABOUT, GuardEvent
from coneskin.timeline import describe

ROOT = Path(__file__).parents[2]
TOUCH = {"sensor": "skin", "link": "forearm", "u": 0.0701, "phi": 1.5708, "level": 0.6, "location_valid": True}
#: details as the guard gives them, and what a person reads
LINES: dict[str, tuple[dict[str, Any], str]] = {
    "waiting": ({"reasons": ["a is silent", "b is touched"]}, "waiting: a is silent; b is touched"),
    "armed": ({}, "armed"),
    "contact": (TOUCH, "touch on skin (forearm): u = 70.1 mm, phi = 90.0 deg, level 0.60"),
    "contact_placed": (TOUCH, "the touch on skin (forearm): u = 70.1 mm, phi = 90.0 deg, level 0.60"),
    "touch_ended": ({"sensor": "skin"}, "touch on skin ended"),
    "fault": ({"what": "skin: silent (51 ms)"}, "fault: skin: silent (51 ms)"),
    "stopping": ({"why": "touch"}, "stop: touch"),
    "slower": ({"speed": 0.81234}, "joint speed falling: 0.812 rad/s"),
    "standstill": ({"speed": 0.001, "ways": ["owner", "dashboard"]}, "standing: 0.0010 rad/s, by owner, dashboard"),
    "escalated": ({"way": "dashboard"}, "no slowdown: next way to stop, dashboard"),
    "not_standing": (
        {"rounds": 2, "speed": 0.25},
        "NOT standing, 0.250 rad/s: round 2 of all ways to stop is over; use the emergency stop",
    ),
    "retreating": ({}, "retreating"),
    "slowing": ({"slider": 0.2, "before": 1.0}, "slower: speed slider from 100 % to 20 %"),
    "resumed": ({"slider": 1.0}, "free again: speed slider back to 100 %"),
    "clipped": ({"by": ["joint speed", "singularity"]}, "retreat slower than set, because of joint speed, singularity"),
    "retreated": ({"progress": 0.05, "complete": True, "why": "distance"}, "retreated 50.0 mm: distance"),
    "latched": ({"why": "touch"}, "latched until a person resets: touch"),
    "refused": ({"what": "reset", "reasons": ["it is touched", "x"]}, "reset refused: it is touched; x"),
    "reset": ({}, "reset"),
    "message": ({"what": "recording ended"}, "message: recording ended"),
    "ending": ({"what": "told to end"}, "ending: told to end"),
    **{name: ({"what": "no port"}, f"{name}: no port") for name in sorted(ABOUT)},
}


def names_in_the_code() -> set[str]:
    """Every name with which a GuardEvent is made, read from the source."""
    found: set[str] = set()
    for path in [*ROOT.glob("robot/*.py"), *ROOT.glob("src/coneskin/*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name | ast.Attribute):
                continue
            maker = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if maker in ("tell", "_say", "GuardEvent"):
                arguments = node.args[1:2] if maker == "tell" else node.args[:1]
                words = [part for argument in arguments for part in _values(argument)]
                found |= {
                    part.value for part in words if isinstance(part, ast.Constant) and isinstance(part.value, str)
                }
    return found


def _values(node: ast.expr) -> list[ast.expr]:
    """An argument, or both sides of a conditional one."""
    return [node.body, node.orelse] if isinstance(node, ast.IfExp) else [node]


def test_every_event_that_the_code_makes_is_here() -> None:
    documented = set(re.findall(r'"(\w+)"', (GuardEvent.__doc__ or "").split("time:")[0]))
    assert names_in_the_code() | ABOUT == set(LINES) == documented | ABOUT


@pytest.mark.parametrize("name", LINES)
def test_its_line(name: str) -> None:
    details, words = LINES[name]
    assert describe(GuardEvent(name, 1001.25, details), 1000.0) == f"   1.2500 s  {words}"


@pytest.mark.parametrize(
    ("how", "words"), [("path", "going back the way the arm came"), ("push", "giving way to the push")]
)
def test_how_it_leaves(how: str, words: str) -> None:
    assert describe(GuardEvent("retreating", 1.0, {"how": how}), 1.0).endswith(f"  {words}")


@pytest.mark.parametrize(
    ("name", "details", "words"),
    [
        ("clipped", {"by": ["damping", "level"]}, "giving way slower than set, because of damping, level"),
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
    assert timeline._ENDED in (ROOT / "robot" / "guard_loop.py").read_text(encoding="utf-8")
    comply = (ROOT / "robot" / "comply.py").read_text(encoding="utf-8")
    assert all(f'"{word}"' in comply for word in (timeline._RELEASED, *timeline._PUSH))
    others = [path for path in (ROOT / "robot").glob("*.py") if path.name != "comply.py"]
    assert not [path.name for path in others if timeline._RELEASED in path.read_text(encoding="utf-8")]


def test_a_place_that_is_not_sure_says_so() -> None:
    line = describe(GuardEvent("contact", 0.0, {**TOUCH, "location_valid": False}), 0.0)
    assert line.endswith("(place not settled yet)")
