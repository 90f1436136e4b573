"""Readers of the tables of an arm: [arm], [monitoring], [reaction], [motion], [[body]] and [padding].

Each takes the tables of the whole file, and adds every mistake to ``problems``. What is not there is None, as is what
has a mistake.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError
from coneskin.core.keys import Key, check
from coneskin.scene.values.scene import ArmScene, BodyScene, MotionScene

from . import keys as k

if TYPE_CHECKING:
    from coneskin.robot.reaction.rules import Rule
    from coneskin.robot.reaction.types import Reaction
    from coneskin.robot.stop.limits import MonitoringLimits
    from coneskin.skin.materials import Padding

_HOST_AND_MORE = re.compile(r"/|^[^:]*:[^:]*$")  # a scheme, a path, or a port; an IPv6 address has two colons or more
_WAYPOINT_KEYS = (replace(k.MOTION_KEYS[0], name="q_deg"),)
_RULE_CONDITIONS = ("link", "level_above", "speed_above")  # of a rule
#: keys that a kind must have, because nothing is known that holds for all
_NEEDED_VALUES = {
    "wall": ("direction",),
    "post": ("direction",),
    "mass": ("mass",),
    "hand": ("mass", "stiffness"),
    "person": ("mass", "stiffness", "force"),
    "grip": ("mass", "stiffness", "force", "direction"),
}


def read_arm(tables: Mapping[str, Any], problems: list[str]) -> ArmScene | None:
    """Return the arm."""
    if "arm" not in tables:
        return None
    values = check(tables["arm"], k.ARM_KEYS, "arm", problems)
    if "model" in values:
        from coneskin.robot.arm.models import arm_model

        try:
            values["model"] = arm_model(values["model"]).name
        except ConeSkinError as exc:
            problems.append(f"arm.model: {exc}")
            del values["model"]
    if not values.get("host", "?").strip():
        problems.append("arm.host must name the controller, got an empty text")
    elif _HOST_AND_MORE.search(host := values.get("host", "").strip()):
        alone = host.rpartition("://")[2].partition("/")[0].partition(":")[0]
        remedy = f'write "{alone}": the ports are those of the arm\'s model'
        problems.append(f"arm.host must be a name or address, without scheme, port or path, got {host!r}; {remedy}")
    if len(values) < len(k.ARM_KEYS):
        return None
    del values["speed_limit_from"]  # the table stands in place of it
    return ArmScene(watchdog_hz=values.pop("watchdog"), **values)


def read_monitoring(tables: Mapping[str, Any], problems: list[str]) -> MonitoringLimits | None:
    """Return the limits of [monitoring], the defaults included; None where the scene has no such table."""
    if "monitoring" not in tables:
        return None
    from coneskin.robot.stop.limits import MonitoringLimits

    return MonitoringLimits(**_given(check(tables["monitoring"], k.MONITORING_KEYS, "monitoring", problems)))


def read_motion(tables: Mapping[str, Any], problems: list[str]) -> MotionScene | None:
    """Return the motion."""
    if "motion" not in tables:
        return None
    rows = tables["motion"].get("waypoints_deg")
    points = []
    if isinstance(rows, list):
        for number, row in enumerate(rows, 1):
            where = f"motion.waypoints_deg[{number}]"
            lines: list[str] = []
            points.append(check({"q_deg": row}, _WAYPOINT_KEYS, where, lines).get("q", ()))
            problems += [line.replace(f"{where}.q_deg", where) for line in lines]
        if len(rows) < 2:
            problems.append(f"motion.waypoints_deg needs at least 2 waypoints, got {len(rows)}")
    table = {key: value for key, value in tables["motion"].items() if key != "waypoints_deg"}
    values = check(table, k.MOTION_KEYS[1:], "motion", problems)
    if not isinstance(rows, list):
        problems.append("motion.waypoints_deg must be a list of lists of 6 joint positions [deg]")
    return MotionScene(tuple(points), **values) if len(values) == len(k.MOTION_KEYS) - 1 else None


def read_reaction(tables: Mapping[str, Any], problems: list[str]) -> tuple[Reaction | None, tuple[Rule, ...]]:
    """Return the reaction of a scene, and its rules in order; a rule with a mistake is left out."""
    if "reaction" not in tables:
        return None, ()
    from coneskin.robot.reaction.types import Reaction

    values = _given(check(tables["reaction"], k.REACTION_KEYS, "reaction", problems))
    rows = values.pop("rule", ())
    reaction = Reaction(**values) if "kind" in values else None
    rules = [_rule(row, f"reaction.rule {n}", reaction or Reaction(), problems) for n, row in enumerate(rows, 1)]
    return reaction, tuple(rule for rule in rules if rule is not None)


def _rule(row: Mapping[str, Any], where: str, default: Reaction, problems: list[str]) -> Rule | None:
    """Read one rule; what it does not set is as in [reaction]."""
    from coneskin.robot.arm.kinematics import link_index
    from coneskin.robot.reaction.rules import Rule

    before = len(problems)
    values = _given(check(row, k.RULE_KEYS, where, problems))
    conditions = {name: values.pop(name) for name in _RULE_CONDITIONS if name in values}
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


def read_bodies(tables: Mapping[str, Any], problems: list[str]) -> tuple[BodyScene, ...]:
    """Return the bodies of a scene; one with a mistake is left out."""
    rows = check({"body": tables.get("body", [])}, (Key("body", dict, ()),), "scene", problems)["body"]
    found = [_body(row, f"body {number}", problems) for number, row in enumerate(rows, 1)]
    return tuple(body for body in found if body is not None)


def _body(row: Mapping[str, Any], where: str, problems: list[str]) -> BodyScene | None:
    before = len(problems)
    values = check(row, k.BODY_KEYS, where, problems)
    kind = values.get("kind", "")
    names = {key.plain: key.name for key in k.BODY_KEYS}
    for name in _NEEDED_VALUES.get(kind, ()):
        if values[name] is None:
            problems.append(f"{where}: a {kind} needs {names[name]}; there is no value that holds for every {kind}")
    if values["direction"] is not None and not any(values["direction"]):
        problems.append(f"{where}.direction must not be 0, 0, 0: it is where the body faces")
    if len(problems) > before:
        return None
    values["place"] = values.pop("xyz")
    values["damping"] = values.pop("damping_ratio")
    return BodyScene(**{name: value for name, value in values.items() if value is not None})


def read_padding(tables: Mapping[str, Any], problems: list[str]) -> Padding | None:
    """Return the padding of a scene's skins; what has a mistake has its default."""
    if "padding" not in tables:
        return None
    from coneskin.skin.materials import Padding

    values = check(tables["padding"], k.PADDING_KEYS, "padding", problems)
    return Padding(values["thickness"], values["stiffness"], values["hard"], values["loss"])
