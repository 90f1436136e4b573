"""Reader of the tables of an arm: [arm], [monitoring], [reaction], [motion], [[body]] and [padding]."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError, SensorError
from coneskin.core.keys import Key, check
from coneskin.scene.values.scene import ArmScene, BodyScene, MotionScene

from . import keys as k

if TYPE_CHECKING:
    from coneskin.robot.reaction.rules import Rule
    from coneskin.robot.reaction.types import Reaction
    from coneskin.robot.stop.limits import MonitoringLimits
    from coneskin.skin.materials import Padding

#: in a text that may have a scheme, a user, a port and a path as well
_HOST_IN_TEXT = re.compile(r"(?:\w+://|(?!\w+://))(?:[^@/]*@)?(?:\[([^]]+)\]|([\w.-]+))")
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


def read_arm_tables(tables: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Return what the tables of the whole file say of the arm, as fields of ``Scene``; None for what is not there.

    Every mistake is added to the problems; what has one is None as well.
    """
    reaction, rules = _reaction(tables["reaction"], problems) if "reaction" in tables else (None, ())
    readers = {"arm": _arm, "monitoring": _monitoring, "motion": _motion, "padding": _padding}
    found = {name: read(tables[name], problems) if name in tables else None for name, read in readers.items()}
    return {**found, "reaction": reaction, "rules": rules, "bodies": _bodies(tables.get("body", []), problems)}


def _arm(table: Mapping[str, Any], problems: list[str]) -> ArmScene | None:
    values = check(table, k.ARM_KEYS, "arm", problems)
    if "model" in values:
        from coneskin.robot.arm.models import arm_model

        try:
            values["model"] = arm_model(values["model"]).name
        except ConeSkinError as exc:
            problems.append(f"arm.model: {exc}")
            del values["model"]
    if not values.get("host", "?").strip():
        problems.append("arm.host must name the controller, got an empty text")
    elif not _is_host(host := values.get("host", "?").strip()):
        alone = _HOST_IN_TEXT.match(host)
        remedy = f'write "{found}"' if alone and _is_host(found := alone[1] or alone[2]) else "write such as 10.0.0.2"
        what = f"arm.host must be a name or address, without scheme, port or path, got {host!r}"
        problems.append(f"{what}; {remedy}: the ports are those of the arm's model")
    if len(values) < len(k.ARM_KEYS):
        return None
    del values["speed_limit_from"]  # the table stands in place of it
    return ArmScene(watchdog_hz=values.pop("watchdog"), **values)


def _is_host(text: str) -> bool:
    """Tell whether a text may be a computer's name or address, of either version."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return re.fullmatch(r"[\w-]{1,63}(\.[\w-]{1,63})*\.?|\?", text) is not None
    return True


def _monitoring(table: Mapping[str, Any], problems: list[str]) -> MonitoringLimits:
    """Return the limits of [monitoring], the defaults included."""
    from coneskin.robot.stop.limits import MonitoringLimits

    return MonitoringLimits(**_given(check(table, k.MONITORING_KEYS, "monitoring", problems)))


def _motion(table: Mapping[str, Any], problems: list[str]) -> MotionScene | None:
    rows = table.get("waypoints_deg")
    points = []
    if isinstance(rows, list):
        for number, row in enumerate(rows, 1):
            where = f"motion.waypoints_deg[{number}]"
            lines: list[str] = []
            points.append(check({"q_deg": row}, _WAYPOINT_KEYS, where, lines).get("q", ()))
            problems += [line.replace(f"{where}.q_deg", where) for line in lines]
        if len(rows) < 2:
            problems.append(f"motion.waypoints_deg needs at least 2 waypoints, got {len(rows)}")
    others = {key: value for key, value in table.items() if key != "waypoints_deg"}
    values = check(others, k.MOTION_KEYS[1:], "motion", problems)
    if not isinstance(rows, list):
        problems.append("motion.waypoints_deg must be a list of lists of 6 joint positions [deg]")
    return MotionScene(tuple(points), **values) if len(values) == len(k.MOTION_KEYS) - 1 else None


def _reaction(table: Mapping[str, Any], problems: list[str]) -> tuple[Reaction | None, tuple[Rule, ...]]:
    """Return the reaction of a scene, and its rules in order; a rule with a mistake is left out."""
    from coneskin.robot.reaction.types import Reaction

    values = _given(check(table, k.REACTION_KEYS, "reaction", problems))
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


def _bodies(table: Any, problems: list[str]) -> tuple[BodyScene, ...]:
    """Return the bodies of a scene; one with a mistake is left out."""
    rows = check({"body": table}, (Key("body", dict, ()),), "scene", problems)["body"]
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


_FIRST_FORCE = 10.0  # N


def _padding(table: Mapping[str, Any], problems: list[str]) -> Padding:
    """Return the padding of a scene's skins; what has a mistake has its default."""
    from coneskin.skin.materials import Padding

    values = check(table, k.PADDING_KEYS, "padding", problems)
    thickness, stiffness, depths, forces, spread, hard, loss = values.values()
    if (depths or forces) and table.keys() & {"thickness_mm", "stiffness_n_per_mm"}:
        problems.append("padding: depths_mm and forces_n stand in place of thickness_mm and stiffness_n_per_mm")
    if len(depths) != len(forces):
        problems.append(f"padding needs a force for each depth, got {len(depths)} depths_mm and {len(forces)} forces_n")
        return Padding()
    if forces and forces[0] > _FIRST_FORCE:
        first = f"padding: forces_n must begin with at most {_FIRST_FORCE:g} N, got {forces[0]:g} N"
        problems.append(
            f"{first}: the line from 0 to it counts work that no foam takes; measure from the first touch on"
        )
    try:
        padding = Padding(thickness, stiffness, hard, loss, tuple(zip(depths, forces, strict=True)), spread)
        last = padding.pieces[-2][2]
        if depths and hard < last:
            was = f"{1e-3 * hard:g} N/mm behind {1e-3 * last:g} N/mm"
            problems.append(f"padding: hard_n_per_mm must be at least the last slope of the table, got {was}")
        return padding
    except SensorError as exc:
        problems.append(f"padding: {exc}")
        return Padding()
