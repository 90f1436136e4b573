"""Reader of the [reaction] table of a scene and its rules: what the arm does when it is touched, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.robot.reaction.rules import Rule
    from coneskin.robot.reaction.types import Reaction

__all__ = ["REACTION_KEYS", "RULE_KEYS", "read_reaction"]

_SETTINGS = (
    Key("kind", str, choices=("slow", "comply", "retreat", "stop")),
    Key("deceleration_rad_s2", low=0.5, high=40.0),
    Key("distance_mm", low=1.0, high=500.0),
    Key("speed_mm_s", low=1.0, high=1500.0),
    Key("acceleration_rad_s2", low=0.1, high=40.0),
    Key("time_budget_s", low=0.05, high=60.0),
    Key("arm_speed_mm_s", low=1.0, high=5000.0),
    Key("arm_distance_mm", low=1.0, high=2000.0),
    Key("on_resistance", str, "stop", choices=("stop", "back", "comply")),
    Key("on_clamp", str, "stop", choices=("stop", "path", "comply")),
    Key("fallback", str, "stop", choices=("stop", "path")),
    Key("full_level", low=0.01, high=1.0),
    Key("slow_to", low=0.05, high=0.9),
    Key("slow_speed_mm_s", low=1.0, high=1500.0),
    Key("press_mm", low=0.1, high=100.0),
)
REACTION_KEYS = (*_SETTINGS, Key("rule", dict, ()))
RULE_KEYS = (
    Key("link", str, None),
    Key("level_above", float, None, low=0.0, high=1.0),
    Key("speed_above_rad_s", float, None, low=0.0, high=10.0),
    _SETTINGS[0],
    *(replace(key, default=None) for key in _SETTINGS[1:]),
)
_CONDITIONS = ("link", "level_above", "speed_above")


def read_reaction(table: Mapping[str, Any], problems: list[str]) -> tuple[Reaction | None, tuple[Rule, ...]]:
    """Return the reaction of a scene, and its rules in order.

    Args:
        table: [reaction].
        problems: every mistake is added here.

    Returns:
        None for the reaction where it has a mistake; a rule with one is left out.
    """
    from coneskin.robot.reaction.types import Reaction

    optional = tuple(key if key.kind in (str, dict) else replace(key, default=None) for key in REACTION_KEYS)
    values = _given(check(table, optional, "reaction", problems))
    rows = values.pop("rule", ())
    reaction = Reaction(**values) if "kind" in values else None
    rules = [_rule(row, f"reaction.rule {n}", reaction or Reaction(), problems) for n, row in enumerate(rows, 1)]
    return reaction, tuple(rule for rule in rules if rule is not None)


def _rule(row: Mapping[str, Any], where: str, default: Reaction, problems: list[str]) -> Rule | None:
    """Read one rule; what it does not set is as in [reaction]."""
    from coneskin.robot.arm.link_frames import link_index
    from coneskin.robot.reaction.rules import Rule

    before = len(problems)
    values = _given(check(row, RULE_KEYS, where, problems))
    conditions = {name: values.pop(name) for name in _CONDITIONS if name in values}
    if not conditions and len(problems) == before:
        problems.append(f"{where} has no condition: give it link, level_above or speed_above_rad_s")
    if "link" in conditions:
        try:
            conditions["link"] = link_index(conditions["link"])
        except ConeSkinError as exc:
            problems.append(f"{where}.link: {exc}")
    return Rule(replace(default, **values), **conditions) if len(problems) == before else None


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
