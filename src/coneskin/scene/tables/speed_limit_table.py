"""Permissible speeds of a scene's skins, as the guard keeps them: reader of the table [speed_limit].

``coneskin permissible`` writes the table into a file of its own, and a scene names it: ``arm.speed_limit_from``. The
reader puts the table in place of the name, so that a recording is whole. It holds for the arm, sheets, padding and
reactions that it was computed for; after a change of one of them it is void, and the scene is refused.
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.bounded_file import read_file
from coneskin.scene.sensor_facts import round_facts
from coneskin.scene.speed_limit import LimitedPatch, SpeedLimitScene

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.scene.scene import Scene

__all__ = [
    "SPEED_LIMIT_KEYS",
    "check_speed_limit",
    "inline_speed_limit",
    "limit_fingerprint",
    "read_speed_limit",
]

_FORMAT = 1  # to be raised where the model changes, so that old files are void
_MAX_BYTES = 1 << 20  # of a file; a map of ten sheets has 100 kB
_MAX_ROWS = 20_000
HOW_TO = "run `coneskin permissible`, and name what it writes"
SPEED_LIMIT_KEYS = (
    Key("format", int, low=1, high=1000),
    Key("fingerprint", str),
    Key("date", str),
    Key("coneskin", str),
    Key("edition", str),
    Key("transcribed_by", str),
    Key("verified_by", str),
    Key("measured_by", str),
    Key("reaction_ms", low=0.0, high=1000.0),
    Key("deceleration_rad_s2", low=0.1, high=100.0),
    Key("lowest_deg", list, (), low=-363.0, high=363.0),
    Key("highest_deg", list, (), low=-363.0, high=363.0),
    Key("levers_mm", list, low=0.1, high=10_000.0),
    Key("curves", int, low=1, high=_MAX_ROWS),
    Key("patches", int, low=1, high=_MAX_ROWS),
    Key("curve", dict),
    Key("patch", dict),
)
_CURVE = (
    Key("region", str),
    Key("mass_kg", float, None, low=0.0, high=1e6),
    Key("speeds_mm_s", list, low=0.0, high=10_000.0),
)
_PATCH = (
    Key("sensor", str),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.001),
    Key("curve", int, low=0, high=_MAX_ROWS),
    Key("any_curve", int, low=0, high=_MAX_ROWS),
)


def limit_fingerprint(scene: Scene) -> str:
    """Return a hash of all that permissible speeds depend on: arm, places of the sheets, padding, ways to react."""
    from coneskin.skin.padding import Padding

    reactions = [scene.default_reaction, *(rule.reaction for rule in scene.rules)]
    facts = {
        "format": _FORMAT,
        "arm": scene.arm.model if scene.arm else None,
        "sheets": [
            [link.name, link.frame, item.sensor.name, asdict(item.sensor.frustum), *_place(item.placed)]
            for link in scene.links
            for item in link.sensors
        ],
        "padding": asdict(scene.padding or Padding()),
        "reactions": [[reaction.kind, reaction.deceleration] for reaction in reactions],
    }
    return hashlib.sha256(json.dumps(round_facts(facts), sort_keys=True).encode()).hexdigest()


def _place(placed: PlacedFrustum) -> list[Any]:
    pose = placed.link_frustum
    bends = [[[bend.width, bend.turn] for bend in placed.bends], placed.lift] if placed.bends else []
    return [[pose.rotation, pose.translation], *bends]


def inline_speed_limit(tables: dict[str, Any], folder: Path | None, problems: list[str]) -> bool:
    """Put the table of the file that a scene names in place of the name; return whether there was one.

    Args:
        tables: of the whole scene; they are changed.
        folder: folder to which the name is relative; None where no file may be opened.
        problems: every mistake is added here.
    """
    arm = tables.get("arm")
    if not isinstance(arm, dict) or "speed_limit_from" not in arm:
        return False
    (name,) = check(
        {"speed_limit_from": arm.pop("speed_limit_from")}, (Key("speed_limit_from", str, None),), "arm", problems
    ).values()
    if folder is None:
        problems.append(f"arm.speed_limit_from: a recording carries the speeds and names no file, got {name}")
    elif "speed_limit" in tables:
        problems.append("[speed_limit] cannot stand beside arm.speed_limit_from, which gives it: leave one out")
    elif name is not None:
        _read(tables, folder / name, problems)
    return True


def _read(tables: dict[str, Any], path: Path, problems: list[str]) -> None:
    try:
        found = tomllib.loads(read_file(path, _MAX_BYTES).decode("utf-8-sig"))
    except OSError as exc:
        problems.append(f"arm.speed_limit_from: {path} cannot be read: {exc.strerror or exc}; {HOW_TO}")
        return
    except (ValueError, RecursionError) as exc:
        problems.append(f"arm.speed_limit_from: {path} is not TOML: {exc}")
        return
    if set(found) != {"speed_limit"} or not isinstance(found["speed_limit"], dict):
        problems.append(f"arm.speed_limit_from: {path} must hold one table, [speed_limit]; {HOW_TO}")
        return
    tables["speed_limit"] = found["speed_limit"]


def read_speed_limit(tables: Mapping[str, Any], problems: list[str]) -> SpeedLimitScene | None:
    """Return the permissible speeds of a scene; None where it names none, or they have a mistake.

    Args:
        tables: of the whole file.
        problems: every mistake is added here.
    """
    if "speed_limit" not in tables:
        return None
    lines: list[str] = []
    values = check(tables["speed_limit"], SPEED_LIMIT_KEYS, "speed_limit", lines)
    counts = [values.pop(key, None) for key in ("curves", "patches")]
    rows = values.pop("curve", ())[:_MAX_ROWS]
    curves = [check(row, _CURVE, f"speed_limit.curve {n}", lines) for n, row in enumerate(rows)]
    rows = values.pop("patch", ())[:_MAX_ROWS]
    patches = [check(row, _PATCH, f"speed_limit.patch {n}", lines) for n, row in enumerate(rows)]
    levers = values.get("levers", ())
    if not lines:
        if values["format"] != _FORMAT:
            lines.append(f"speed_limit.format must be {_FORMAT}, got {values['format']}: {HOW_TO}")
        if counts != [len(curves), len(patches)]:
            lines.append(
                f"speed_limit: curves = {counts[0]} and patches = {counts[1]} were written, there are {len(curves)} "
                f"and {len(patches)}: the file was cut or changed; {HOW_TO}"
            )
        if not levers or any(b <= a for a, b in pairwise(levers)):
            lines.append("speed_limit.levers_mm must rise")
        if not curves or any(len(curve["speeds"]) != len(levers) for curve in curves):
            lines.append("speed_limit.curve: each needs one speed for each of levers_mm, and there must be one")
        if not patches or any(max(row["curve"], row["any_curve"]) >= len(curves) for row in patches):
            lines.append("speed_limit.patch: each needs a curve that there is, and there must be one")
        if {len(values["lowest"]), len(values["highest"])} not in ({0}, {6}):
            lines.append("speed_limit: lowest_deg and highest_deg have six numbers each, or none")
    problems += lines[:10]
    if lines:
        return None
    found = tuple(LimitedPatch(row["sensor"], row["u"], row["phi"], row["curve"], row["any_curve"]) for row in patches)
    return SpeedLimitScene(curves=tuple(tuple(curve["speeds"]) for curve in curves), patches=found, **values)


def check_speed_limit(scene: Scene, recorded: bool, problems: list[str]) -> None:
    """Add what stands against the permissible speeds of a scene.

    Args:
        scene: the whole of it.
        recorded: it comes from a recording, and was checked when the guard began.
        problems: every mistake is added here.
    """
    limit = scene.speed_limit
    if limit is None:
        return
    if scene.arm is None:
        problems.append("[speed_limit] needs an [arm] that can be slowed down")
        return
    if any(reaction.kind == "slow" for reaction in (scene.default_reaction, *(rule.reaction for rule in scene.rules))):
        problems.append(
            "arm.speed_limit_from: the speeds hold for an arm that stops when it is touched; a reaction is slow"
        )
    if recorded or problems:
        return
    if limit.fingerprint != limit_fingerprint(scene):
        problems.append(
            f"arm.speed_limit_from: the permissible speeds of {limit.date[:10]} are of another scene: arm, sheets, "
            f"padding or reactions are others now; {HOW_TO}"
        )
        return
    names = {item.sensor.name for item in scene.sensors}
    if missing := names ^ {patch.sensor for patch in limit.patches}:
        problems.append(f"arm.speed_limit_from: {', '.join(sorted(missing))}: not in both the scene and the speeds")
