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
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.bounded_file import read_file
from coneskin.scene.values.sensor_facts import round_facts
from coneskin.scene.values.speed_limit import LimitedPatch, SpeedLimitScene

from .schema import Key, check
from .speed_limit_check import limit_digest, uncovered, unfit

if TYPE_CHECKING:
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.scene.values.scene import Scene

__all__ = [
    "SPEED_LIMIT_KEYS",
    "check_speed_limit",
    "inline_speed_limit",
    "limit_fingerprint",
    "read_speed_limit",
]

_MODEL_NUMBER = 1  # part of the fingerprint: raise it where the computation changes, so that computed files are void
_MAX_BYTES = 1 << 20  # of a file; a map of ten sheets has 100 kB
_MAX_ROWS = 20_000
_MAX_LINES = 10  # of mistakes
HOW_TO = "run `coneskin permissible`, and name what it writes"
SPEED_LIMIT_KEYS = (
    Key("digest", str),
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
    Key("curve", dict),
    Key("patch", dict),
)
_CURVE = (
    Key("region", str),
    Key("mass_kg", float, None, low=0.0, high=1e6),
    Key("lag_mm", float, 0.0, low=0.0, high=1e5),
    Key("bend_mm", float, 0.0, low=0.0, high=1e5),
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
    from coneskin.skin.materials import Padding

    reactions = [scene.default_reaction, *(rule.reaction for rule in scene.rules)]
    facts = {
        "model": _MODEL_NUMBER,
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
    table = tables["speed_limit"]
    values = check(table, SPEED_LIMIT_KEYS, "speed_limit", lines)
    digest = values.pop("digest", "")
    rows = values.pop("curve", ())[:_MAX_ROWS]
    curves = [check(row, _CURVE, f"speed_limit.curve {n}", lines) for n, row in enumerate(rows)]
    rows = values.pop("patch", ())[:_MAX_ROWS]
    patches = [check(row, _PATCH, f"speed_limit.patch {n}", lines) for n, row in enumerate(rows)]
    found = None
    if not lines:
        speeds = tuple(tuple(curve["speeds"]) for curve in curves)
        limited = tuple(LimitedPatch(*(row[key.plain] for key in _PATCH)) for row in patches)
        found = SpeedLimitScene(curves=speeds, patches=limited, **values)
        lines += unfit(found)
        if digest != limit_digest(table):
            lines.insert(0, "speed_limit.digest is not that of the table: the file was cut, or changed by hand")
    problems += [f"{line}; {HOW_TO}" for line in lines[:_MAX_LINES]]
    return None if lines else found


def check_speed_limit(scene: Scene, recorded: bool, problems: list[str]) -> None:
    """Add what stands against the permissible speeds of a scene.

    Args:
        scene: the whole of it.
        recorded: it comes from a recording, and was checked when the guard began.
        problems: every mistake is added here.
    """
    from coneskin.robot.arm.link_frames import link_index

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
            f"padding or reactions are others now, or coneskin computes them otherwise; {HOW_TO}"
        )
        return
    sheets = {item.sensor.name: item.placed for link in scene.links if link_index(link.name) for item in link.sensors}
    of_sheet: dict[str, list[LimitedPatch]] = {name: [] for name in sheets}
    strange: list[LimitedPatch] = []
    for patch in limit.patches:
        of_sheet.get(patch.sensor, strange).append(patch)
    names = sorted({patch.sensor for patch in strange} | {name for name, patches in of_sheet.items() if not patches})
    lines = [f"{name}: not in both the scene and the speeds" for name in names]
    lines = lines or [
        line for name, placed in sheets.items() for line in uncovered(name, placed.frustum, of_sheet[name])
    ]
    problems += [f"arm.speed_limit_from: {line}; {HOW_TO}" for line in lines[:_MAX_LINES]]
