"""Readers of [source], or several [[source]], by the row of `SOURCE_KINDS` for the kind, and of [[source.touch]]."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import SensorError
from coneskin.core.keys import Key, check
from coneskin.scene.values.scene import SourceScene
from coneskin.skin.sources.kinds import GROUP, SOURCE_KINDS, find_kind

from .keys import TOUCH_KEYS, source_keys

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch


def read_source(
    tables: Mapping[str, Any] | Sequence[Any], sensors: Sequence[Sensor | None], problems: list[str]
) -> SourceScene | None:
    """Read a [source] table, or several [[source]]; None where the kind is missing or wrong.

    Args:
        sensors: that a script may touch; None stands for each that has a mistake.
        problems: every mistake is added to them.
    """
    values = _read_sources(tables, problems)
    rows = enumerate(values.pop("touch", ()), 1)
    touches = [_read_touch(sensors, row, f"source.touch {number}", problems) for number, row in rows]
    kind = values.pop("kind", None)
    made = tuple(touch for touch in touches if touch is not None)
    return None if kind is None else SourceScene(kind, MappingProxyType(values), made)


def _read_sources(tables: Mapping[str, Any] | Sequence[Any], problems: list[str]) -> dict[str, Any]:
    """Check a [source] table, or several [[source]], and convert them.

    Returns:
        as ``_read_source`` does; of several the kind is ``GROUP`` and ``members`` holds kind and values of each.
    """
    if isinstance(tables, Mapping) or len(tables) == 1:
        return _read_source(tables if isinstance(tables, Mapping) else tables[0], problems)
    members = []
    for number, table in enumerate(tables, 1):
        where = f"source {number}"
        values = _read_source(table, problems, where)
        kind = values.pop("kind", None)
        if kind in SOURCE_KINDS and SOURCE_KINDS[kind].simulated:
            problems.append(f"{where}: a virtual skin plays all sensors of a scene, so it is the only [source]")
        elif (kind, values) in members:
            problems.append(f"{where} is the same as another one: no port can be read twice")
        if kind is not None:
            members.append((kind, values))
    return {"kind": GROUP, "members": tuple(members)}


def _read_source(table: Mapping[str, Any], problems: list[str], where: str = "source") -> dict[str, Any]:
    """Check a [source] table and convert it.

    Returns:
        ``kind``, absent where it is missing or wrong, and the values of its keys: SI, under their names without the
        unit. A key with a mistake has its default.
    """
    kind, *keys = source_keys()
    try:
        row = find_kind(str(table.get("kind")))
    except SensorError as exc:
        problems.append(f"{where}.kind: {exc}")
        return {}
    if row is None:
        return check(table, (kind, *(_optional(key) for key in keys)), where, problems)
    kind = replace(kind, choices=(*kind.choices, str(table["kind"])))  # it may be an installed package's
    own = {key.name for key in row.keys}
    stray = [key.name for key in keys if key.name in table and key.name not in own]
    problems += [f"{where}.{name} means nothing to kind {table['kind']}: remove it" for name in stray]
    for key in row.keys:
        if key.default is ... and table.get(key.name, "") == "":
            problems.append(f"{where}.{key.name} is missing: {key.meaning}")
    known = {name: value for name, value in table.items() if name not in stray}
    return check(known, (kind, *(_optional(key) for key in row.keys)), where, problems)


def source_label(source: SourceScene) -> str:
    """Return the kind and the values that have no default, which distinguish one source from another."""
    if source.kind == GROUP:
        return " + ".join(_label(kind, settings) for kind, settings in source.settings["members"])
    return _label(source.kind, source.settings)


def _label(kind: str, settings: Mapping[str, Any]) -> str:
    row = find_kind(kind)
    keys = row.keys if row else ()
    return " ".join([kind, *(str(settings[key.plain]) for key in keys if key.default is ...)])


def _optional(key: Key) -> Key:
    """Return the key as an optional one; `_read_source` reports better what is missing."""
    return replace(key, default=None) if key.default is ... else key


def _read_touch(
    sensors: Sequence[Sensor | None], table: Mapping[str, Any], where: str, problems: list[str]
) -> ScriptedTouch | None:
    """Read a scripted touch."""
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch

    before = len(problems)
    values = check(table, TOUCH_KEYS, where, problems)
    start, end = values.get("start", -math.inf), values.get("end", math.inf)
    if not start < end:
        problems.append(f"{where}: start_s must be before end_s, got {start:g} s and {end:g} s")
    wanted = values.pop("sensor")
    known = () if wanted is None and None in sensors else sensors  # the first of them may be one with a mistake
    sensor = next((one for one in known if one is not None and wanted in (None, one.sensor_id)), None)
    if sensor is None:
        if None not in sensors:  # otherwise it may be that one
            problems.append(f"{where}: there is no sensor {'to touch' if wanted is None else f'with the id {wanted}'}")
        return None
    cone = sensor.frustum
    u, phi = values.get("u", 0.0), values.get("phi", 0.0)
    if u > cone.slant or phi > cone.wrap:
        problems.append(
            f"{where} is off {sensor.name}, whose u_mm ends at {1e3 * cone.slant:g} and phi_deg at "
            f"{math.degrees(cone.wrap):g}: got {1e3 * u:g} mm and {math.degrees(phi):g} deg"
        )
    if values.get("grown_force") and not values.get("growth_time"):
        problems.append(f"{where}: grown_force_n needs a growth_time_s above 0 s")
    return ScriptedTouch(**values, sensor=sensor.name) if len(problems) == before else None
