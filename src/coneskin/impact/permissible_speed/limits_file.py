"""File of the limits that are to be kept: whose they are, who checked them, and what was measured on the arm.

None of these values comes with this package. Copies of the tables of ISO/TS 15066 that circulate contradict each other:
whoever uses them buys the edition that applies, transcribes it and lets somebody else compare. The keys are described
in docs/do/permissible-speed.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError, SceneError
from coneskin.core.files import read_text
from coneskin.core.keys import Key, check
from coneskin.core.text import suggest
from coneskin.core.toml_text import parse_toml
from coneskin.robot.arm.kinematics import link_index
from coneskin.scene.tables.keys import MAX_SIZE

from .two_mass_contact import StruckBody

_LIMIT_KEYS = (Key("edition", str), Key("transcribed_by", str), Key("verified_by", str), Key("region", dict))
_MEASURED_KEYS = (
    Key("reaction_ms", low=0.0, high=1000.0),
    Key("deceleration_rad_s2", low=0.1, high=100.0),
    Key("by", str),
    Key("servo_hz", float, 17.0, low=0.1, high=200.0),
)
_REGION_KEYS = (
    Key("name", str),
    Key("links", list, None),
    Key("mass_kg", float, None, low=1e-3, high=1000.0),
    Key("clamped", bool, False),
    Key("tissue_n_per_mm", float, None, low=0.1, high=10_000.0),
    Key("support_n_per_mm", float, 0.0, low=0.0, high=10_000.0),
    Key("transient_force_n", float, None, low=1.0, high=10_000.0),
    Key("lasting_force_n", float, None, low=1.0, high=10_000.0),
    Key("transient_pressure_n_per_cm2", float, None, low=0.1, high=10_000.0),
    Key("lasting_pressure_n_per_cm2", float, None, low=0.1, high=10_000.0),
    Key("area_cm2", float, None, low=0.01, high=1000.0),
)


@dataclass(frozen=True, slots=True)
class ForceLimits:
    """Limits of the force on a body."""

    transient: float  #: of the peak within the first 0.5 s [N]
    lasting: float  #: of what is left then, and at rest [N]


@dataclass(frozen=True, slots=True)
class BodyRegion:
    """Part of a body that the arm may strike."""

    name: str
    body: StruckBody  #: mass and stiffness
    limits: ForceLimits
    links: frozenset[int] = frozenset()  #: indices of the links that may strike it; empty for all


@dataclass(frozen=True, slots=True)
class MeasuredReaction:
    """How the guarded arm stops, as somebody has measured it."""

    reaction: float  #: from the closing of the layers until the arm brakes [s]
    deceleration: float  #: of the leading joint then [rad/s^2]
    by: str  #: what measured it, and when
    servo: float = 17.0  #: frequency of the joints' servos [Hz]; assumed where nobody has measured it


@dataclass(frozen=True, slots=True)
class LimitsFile:
    """Content of a limits file."""

    edition: str  #: document and edition that the limits are from
    transcribed_by: str  #: who copied them from it
    verified_by: str  #: who compared them with it
    regions: tuple[BodyRegion, ...]  #: that may be struck
    measured: MeasuredReaction  #: how the arm stops


def read_limits(path: Path | str) -> LimitsFile:
    """Read a limits file.

    Raises:
        SceneError: the file cannot be read, or has mistakes; all of them are listed.
    """
    path = Path(path)
    hint = "" if path.exists() else "; docs/do/permissible-speed.md has one to begin with"
    text = read_text(path, MAX_SIZE, "a TOML text", lambda why: SceneError([why], str(path)), hint)
    return _parse_limits(text, path.name)


def _parse_limits(text: str, name: str = "limits") -> LimitsFile:
    """Read the text of a limits file.

    Raises:
        SceneError: with every mistake.
    """
    try:
        tables = parse_toml(text)
    except ValueError as exc:
        raise SceneError([f"not TOML: {exc}"], name) from exc
    problems = [f"unknown table [{t}]; {suggest(t, _TABLE_KEYS)}" for t in tables if t not in _TABLE_KEYS]
    problems += [f"[{t}] is missing: {what}" for t, what in _TABLE_KEYS.items() if not isinstance(tables.get(t), dict)]
    if problems:
        raise SceneError(problems, name)
    limits = check(tables["limits"], _LIMIT_KEYS, "limits", problems)
    measured = check(tables["measured"], _MEASURED_KEYS, "measured", problems)
    for key in ("edition", "transcribed_by", "verified_by"):
        if not str(limits.get(key, "?")).strip():
            problems.append(f"limits.{key} must not be empty: a limit that nobody vouches for is none")
    same = str(limits.get("transcribed_by", "")).strip().casefold()
    if same and same == str(limits.get("verified_by", "")).strip().casefold():
        problems.append(f"limits.verified_by must be somebody else than transcribed_by, got {limits['verified_by']!r}")
    if not str(measured.get("by", "?")).strip():
        problems.append("measured.by must say what measured it, and when")
    rows = limits.get("region", ())
    if "region" in limits and not rows:
        problems.append("[[limits.region]]: at least one is needed")
    regions = [_region(row, f"limits.region {number}", problems) for number, row in enumerate(rows, 1)]
    if problems:
        raise SceneError(problems, name)
    return LimitsFile(
        limits["edition"],
        limits["transcribed_by"],
        limits["verified_by"],
        tuple(region for region in regions if region is not None),
        MeasuredReaction(measured["reaction"], measured["deceleration"], measured["by"], measured["servo"]),
    )


_TABLE_KEYS = {
    "limits": "edition, transcribed_by, verified_by and [[limits.region]]",
    "measured": "reaction_ms, deceleration_rad_s2 and by; how the guarded arm stops was measured by somebody",
}


def _region(row: Mapping[str, Any], where: str, problems: list[str]) -> BodyRegion | None:
    before = len(problems)
    names = row.get("links", [])
    values = check({key: value for key, value in row.items() if key != "links"}, _REGION_KEYS, where, problems)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        problems.append(f"{where}.links must be a list of names of links, got {names!r}")
        names = []
    links = set()
    for name in names:
        try:
            links.add(link_index(name))
        except ConeSkinError as exc:
            problems.append(f"{where}.links: {exc}")
    mass, clamped = values["mass"], values["clamped"]
    if mass is None and not clamped:
        problems.append(f"{where} needs mass_kg, or clamped = true for a body that cannot give way")
    area = values["area"]
    found = {}
    for kind in ("transient", "lasting"):
        force, pressure = values[f"{kind}_force"], values[f"{kind}_pressure"]
        if pressure is not None and area is None:
            problems.append(f"{where}.{kind}_pressure_n_per_cm2 needs area_cm2, the area of the contact")
        by_pressure = math.inf if pressure is None or area is None else pressure * area
        found[kind] = min(math.inf if force is None else force, by_pressure)
        if math.isinf(found[kind]) and pressure is None:
            problems.append(f"{where} needs {kind}_force_n, or {kind}_pressure_n_per_cm2 with area_cm2")
    if len(problems) > before:
        return None
    body = StruckBody(
        math.inf if clamped else mass, math.inf if values["tissue"] is None else values["tissue"], values["support"]
    )
    return BodyRegion(values["name"], body, ForceLimits(found["transient"], found["lasting"]), frozenset(links))
