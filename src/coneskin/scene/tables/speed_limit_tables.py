"""Permissible speeds of a scene's skins, as the guard keeps them: reader of the table [speed_limit].

``coneskin permissible`` writes the table into a file of its own, and a scene names it: ``arm.speed_limit_from``. The
reader puts the table in place of the name, so that a recording is whole. It holds for the arm, sheets, padding and
reactions that it was computed for; after a change of one of them it is void, and the scene is refused.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from coneskin.core.keys import Key, check
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.scene.values.scene import LimitedPatch, Scene, SpeedLimitScene, facts_digest

from .keys import CURVE_KEYS, MAX_ROWS, PATCH_KEYS, SPEED_LIMIT_KEYS
from .sensor_tables import read_toml

_MODEL_NUMBER = 2  # part of the fingerprint: raise it where the computation changes, so that computed files are void
_MAX_BYTES = 1 << 20  # of a file; a map of ten sheets has 100 kB
_MAX_LINES = 10  # of mistakes
_HOW_TO = "run `coneskin permissible`, and name what it writes"


def limit_fingerprint(scene: Scene) -> str:
    """Return a hash of all that permissible speeds depend on: arm, places of the sheets, padding, ways to react."""
    from coneskin.skin.materials import Padding

    reactions = [scene.default_reaction, *(rule.reaction for rule in scene.rules)]
    facts = {
        "model": _MODEL_NUMBER,
        "arm": [scene.arm.model, scene.arm.payload, scene.arm.payload_xyz] if scene.arm else None,
        "sheets": [
            [link.name, link.frame, item.sensor.name, asdict(item.sensor.frustum), *_place(item.placed)]
            for link in scene.links
            for item in link.sensors
        ],
        "padding": asdict(scene.padding or Padding()),
        "reactions": [[reaction.kind, reaction.deceleration] for reaction in reactions],
    }
    return facts_digest(facts)


def _place(placed: PlacedFrustum) -> list[Any]:
    pose = placed.link_frustum
    bends = [[[bend.width, bend.turn] for bend in placed.bends], placed.lift] if placed.bends else []
    return [[pose.rotation, pose.translation], *bends]


def inline_speed_limit(tables: dict[str, Any], folder: Path | None, problems: list[str]) -> bool:
    """Put the table of the file that a scene names in place of the name; return whether there was one.

    Args:
        folder: folder to which the name is relative; None where no file may be opened.
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
    lines: list[str] = []
    found = read_toml(path, _MAX_BYTES, "arm.speed_limit_from", lines)
    if set(found) == {"speed_limit"} and isinstance(found["speed_limit"], dict):
        tables["speed_limit"] = found["speed_limit"]
    elif not lines:
        lines.append(f"arm.speed_limit_from: {path} must hold one table, [speed_limit]")
    problems += [f"{line}; {_HOW_TO}" for line in lines]


def with_speed_limit(scene: Scene, table: Mapping[str, Any], recorded: bool, problems: list[str]) -> Scene:
    """Return a scene with the permissible speeds of a table, and add what stands against them to the problems.

    Args:
        recorded: it comes from a recording, and was checked when the guard began.
    """
    limit = _read_limit(table, problems)
    if limit is not None:
        _check_limit(scene, limit, recorded, problems)
    return replace(scene, speed_limit=limit)


def _read_limit(table: Mapping[str, Any], problems: list[str]) -> SpeedLimitScene | None:
    """Return the permissible speeds of a table; None where they have a mistake, which is added."""
    lines: list[str] = []
    values = check(table, SPEED_LIMIT_KEYS, "speed_limit", lines)
    digest = values.pop("digest", "")
    rows = values.pop("curve", ())[:MAX_ROWS]
    curves = [check(row, CURVE_KEYS, f"speed_limit.curve {n}", lines) for n, row in enumerate(rows)]
    rows = values.pop("patch", ())[:MAX_ROWS]
    patches = [check(row, PATCH_KEYS, f"speed_limit.patch {n}", lines) for n, row in enumerate(rows)]
    found = None
    if not lines:
        speeds = tuple(tuple(curve["speeds"]) for curve in curves)
        limited = tuple(LimitedPatch(*(row[key.plain] for key in PATCH_KEYS)) for row in patches)
        found = SpeedLimitScene(curves=speeds, patches=limited, **values)
        lines += _unfit(found)
        if digest != limit_digest(table):
            lines.insert(0, "speed_limit.digest is not that of the table: the file was cut, or changed by hand")
    problems += [f"{line}; {_HOW_TO}" for line in lines[:_MAX_LINES]]
    return None if lines else found


def _check_limit(scene: Scene, limit: SpeedLimitScene, recorded: bool, problems: list[str]) -> None:
    from coneskin.robot.arm.kinematics import link_index

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
            f"padding or reactions are others now, or coneskin computes them otherwise; {_HOW_TO}"
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
        line for name, placed in sheets.items() for line in _uncovered(name, placed.frustum, of_sheet[name])
    ]
    problems += [f"arm.speed_limit_from: {line}; {_HOW_TO}" for line in lines[:_MAX_LINES]]


_MAX_STEEPNESS = 1.05  # of the lever's growth by which a speed may grow; the search leaves 1 %, rounding another
_ROUNDING_SPEED = 2e-5  # m/s that rounding leaves of two speeds
#: between two patches around a sheet [rad]; beyond, no factor makes up for what lies between
_MAX_PATCH_GAP = math.radians(90.0)
_ROUNDING_SLACK = 1e-7  # m and rad that the rounding of a file leaves


def limit_digest(table: Mapping[str, Any]) -> str:
    """Return the hash of a table [speed_limit], as it is in the file, without its own digest."""
    facts = {name: value for name, value in table.items() if name != "digest"}
    return hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()


def _unfit(limit: SpeedLimitScene) -> list[str]:
    """Return what in a table does not fit together; nothing where all does."""
    lines = []
    levers = limit.levers
    if not levers or any(b <= a for a, b in pairwise(levers)):
        lines.append("speed_limit.levers_mm must rise")
    if not limit.curves:
        lines.append("speed_limit.curve: there must be one")
    if {len(limit.lowest), len(limit.highest)} not in ({0}, {6}):
        lines.append("speed_limit: lowest_deg and highest_deg have six numbers each, or none")
    for joint, (low, high) in enumerate(zip(limit.lowest, limit.highest, strict=False), 1):
        if low > high:
            lines.append(
                f"speed_limit: joint {joint} has a lowest_deg of {math.degrees(low):.6g} deg, above its highest_deg of "
                f"{math.degrees(high):.6g} deg: no joint position is between them"
            )
    for number, curve in enumerate(limit.curves):
        where = f"speed_limit.curve {number}"
        if len(curve) != len(levers):
            lines.append(f"{where} needs one speed for each of levers_mm: {len(levers)}, got {len(curve)}")
        elif not lines:
            lines += [f"{where}: {line}" for line in _bends(levers, curve)]
    if not limit.patches:
        lines.append("speed_limit.patch: there must be one")
    for number, patch in enumerate(limit.patches):
        if max(patch.curve, patch.any_curve) >= len(limit.curves):
            lines.append(f"speed_limit.patch {number} needs a curve that there is, 0 to {len(limit.curves) - 1}")
    return lines


def _bends(levers: tuple[float, ...], curve: tuple[float, ...]) -> list[str]:
    """Return where a curve is none that a computation gives."""
    if curve[-1] <= 0.0:
        return ["the last of speeds_mm_s must be above 0 mm/s: the arm could not move"]
    for (before, low), (after, high) in pairwise(zip(levers, curve, strict=True)):
        at = f"{1e3 * high:.6g} mm/s after {1e3 * low:.6g} mm/s"
        if high < low:
            return [f"speeds_mm_s must not fall with a longer lever, got {at}"]
        if low > 0.0 and high > _MAX_STEEPNESS * low * after / before + _ROUNDING_SPEED:
            return [
                f"speeds_mm_s must not grow more than the lever does, from {1e3 * before:.6g} to {1e3 * after:.6g} mm "
                f"here, got {at}: the straight line between them would be above what is permissible"
            ]
    return []


def _uncovered(name: str, sheet: Frustum, patches: list[LimitedPatch]) -> list[str]:
    """Return what patches leave of a sheet without a speed, and which of them are not on it.

    The speed along the normal changes evenly between the ends of a sheet: both ends covered, all is.
    """
    for patch in patches:
        if patch.u > sheet.slant + _ROUNDING_SLACK:
            return [f"{name}: u_mm = {1e3 * patch.u:.6g} is off the sheet, which ends at {1e3 * sheet.slant:.6g} mm"]
        if patch.phi > sheet.wrap + _ROUNDING_SLACK:
            wrap = math.degrees(sheet.wrap)
            return [f"{name}: phi_deg = {math.degrees(patch.phi):.6g} is off the sheet, which ends at {wrap:.6g} deg"]
    for u in (0.0, sheet.slant):
        around = sorted(patch.phi for patch in patches if abs(patch.u - u) <= _ROUNDING_SLACK)
        if not around:
            return [f"{name}: no patch at its end u_mm = {1e3 * u:.6g}"]
        for start, end in _gaps(around, sheet.wrap):
            part = f"from {math.degrees(start):.6g} to {math.degrees(end):.6g} deg"
            return [f"{name}: no patch {part} at its end u_mm = {1e3 * u:.6g}"]
    return []


def _gaps(around: list[float], wrap: float) -> list[tuple[float, float]]:
    """Return where patches are too far apart, or an edge has none [rad]."""
    gaps = [(a, b) for a, b in pairwise(around) if b - a > _MAX_PATCH_GAP + _ROUNDING_SLACK]
    if wrap > 2.0 * math.pi - 1e-9:
        beyond = around[0] + 2.0 * math.pi
        return gaps + [(around[-1], beyond)] * (beyond - around[-1] > _MAX_PATCH_GAP + _ROUNDING_SLACK)
    return gaps + [(a, b) for a, b in ((0.0, around[0]), (around[-1], wrap)) if b - a > _ROUNDING_SLACK]
