"""Reader of the [source] table of a scene, or of several [[source]], by the row of `SOURCE_KINDS` for its kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import SensorError
from coneskin.skin.sources.kinds import GROUP, SOURCE_KINDS, SourceKey, find_kind

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.scene.values.scene import SourceScene

__all__ = ["read_source", "read_sources", "source_keys", "source_label"]


def source_keys() -> tuple[Key, ...]:
    """Return every key that a [source] may have: ``kind``, then those of each kind."""
    found = {"kind": Key("kind", str, choices=tuple(SOURCE_KINDS))}
    for row in SOURCE_KINDS.values():
        for key in row.keys:
            found.setdefault(key.name, _key(key))
    return tuple(found.values())


def read_sources(tables: Mapping[str, Any] | Sequence[Any], problems: list[str]) -> dict[str, Any]:
    """Check a [source] table, or several [[source]], and convert them.

    Args:
        tables: from the file: one table, or a list of them.
        problems: every mistake is added here.

    Returns:
        as ``read_source`` does; of several the kind is ``GROUP`` and ``members`` holds kind and values of each.
    """
    if isinstance(tables, Mapping):
        return read_source(tables, problems)
    if len(tables) == 1:
        return read_source(tables[0], problems)
    members = []
    for number, table in enumerate(tables, 1):
        where = f"source {number}"
        values = read_source(table, problems, where)
        kind = values.pop("kind", None)
        if kind in SOURCE_KINDS and SOURCE_KINDS[kind].simulated:
            problems.append(f"{where}: a virtual skin plays all sensors of a scene, so it is the only [source]")
        elif (kind, values) in members:
            problems.append(f"{where} is the same as another one: no port can be read twice")
        if kind is not None:
            members.append((kind, values))
    return {"kind": GROUP, "members": tuple(members)}


def read_source(table: Mapping[str, Any], problems: list[str], where: str = "source") -> dict[str, Any]:
    """Check a [source] table and convert it.

    Args:
        table: from the file.
        problems: every mistake is added here.
        where: name of the table in messages.

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
            problems.append(f"{where}.{key.name} is missing: {key.example}")
    known = {name: value for name, value in table.items() if name not in stray}
    return check(known, (kind, *(_optional(_key(key)) for key in row.keys)), where, problems)


def source_label(source: SourceScene) -> str:
    """Return the kind and the values that have no default, which distinguish one source from another."""
    if source.kind == GROUP:
        return " + ".join(_label(kind, settings) for kind, settings in source.settings["members"])
    return _label(source.kind, source.settings)


def _label(kind: str, settings: Mapping[str, Any]) -> str:
    row = find_kind(kind)
    keys = [_key(key) for key in row.keys] if row else []
    return " ".join([kind, *(str(settings[key.plain]) for key in keys if key.default is ...)])


def _key(key: SourceKey) -> Key:
    return Key(key.name, key.kind, key.default, key.low, key.high, key.choices)


def _optional(key: Key) -> Key:
    """Return the key as an optional one; `read_source` reports better what is missing."""
    return replace(key, default=None) if key.default is ... else key
