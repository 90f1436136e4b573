"""Table of the kinds of source: which class opens each, and which keys a scene's [source] takes for it.

A further sensor bus is one file in this folder and one row of `SOURCE_KINDS`; the scene reader, the session and the
guard's process work from the row. A package of somebody else's brings its row as an entry point of the group
``coneskin.sources``: its name is the kind, and it names a `SourceKind`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from itertools import permutations
from typing import Any, Final

from coneskin.core.errors import SensorError
from coneskin.core.keys import Key, with_meanings

from .source import Source, SourceGroup

#: Kind of several sources that are read as one; its setting ``members`` holds a kind and its settings for each.
GROUP: Final = "group"
_ENTRY_POINTS = "coneskin.sources"


@dataclass(frozen=True, slots=True)
class SourceKind:
    """A kind of source.

    Attributes:
        opener: "module:Class" of the `Source`. It is imported when a source of this kind is opened, and called with the
            values of the keys as keyword arguments: SI, under the names without their units.
        keys: what the scene's [source] takes beside ``kind``.
        simulated: True for a kind that a process of its own plays. Its keys are for that process, and the opener gets
            only the ``port`` that the process names.
    """

    opener: str
    keys: tuple[Key, ...]
    simulated: bool = False


#: Kind, as a scene names it -> its row.
SOURCE_KINDS: dict[str, SourceKind] = {
    "serial": SourceKind(
        "coneskin.skin.sources.serial_port:SerialPort",
        with_meanings(
            """
            port: a device such as /dev/ttyUSB0 or COM3, or a pyserial URL. Use one that stays the same when it is
                plugged in again: /dev/serial/by-id/..., hwgrep://0403:6001
            baud: bits per second
            """,
            Key("port", str),
            Key("baud", int, 921600, low=1200, high=12_000_000),
        ),
    ),
    "virtual": SourceKind(
        "coneskin.skin.sources.serial_port:SerialPort",
        with_meanings(
            """
            rate_hz: frames per second of each sensor; a board sends as many
            seed: seed of the noise
            model: `field`: the exact field in both sheets, so that an extended contact reads with its area error.
                `ladder`: ideal resistors, without numpy
            frame_length: bytes of a frame: 36 with one supply, 40 with that of each phase, 52 with the driven
                electrodes' own potentials as well
            wires: electrodes on the terminals A, B, C, D. Another order is a wrong wiring, to try `coneskin doctor`
            touch: scripted touches, each under `[[source.touch]]`
            """,
            Key("rate_hz", float, 200.0, low=1.0, high=10_000.0),
            Key("seed", int, 0, low=0, high=2**31),
            Key("model", str, "field", choices=("field", "ladder")),
            Key("frame_length", int, 36, choices=(36, 40, 52)),
            Key("wires", str, "ABCD", choices=tuple(map("".join, permutations("ABCD")))),
            Key("touch", dict, ()),
        ),
        simulated=True,
    ),
}


def find_kind(kind: str) -> SourceKind | None:
    """Return the row of a kind, of this package or of an installed one; None where there is none.

    Raises:
        SensorError: an installed package names something else than a row.
    """
    if kind in SOURCE_KINDS or not kind.isprintable():
        return SOURCE_KINDS.get(kind)
    from importlib.metadata import entry_points

    for point in entry_points(group=_ENTRY_POINTS, name=kind):
        try:
            row = point.load()
        except (ImportError, AttributeError) as exc:
            raise SensorError(f"the source {kind!r} of {point.value} cannot be loaded: {exc}") from exc
        if not isinstance(row, SourceKind):
            raise SensorError(f"the source {kind!r} must be a SourceKind, {point.value} is a {type(row).__name__}")
        return row
    return None


def is_simulated(kind: str) -> bool:
    """Tell whether a process of our own plays a source of this kind."""
    return kind in SOURCE_KINDS and SOURCE_KINDS[kind].simulated


def open_source(kind: str, settings: Mapping[str, Any], port: str = "") -> Source:
    """Make the source of a scene; like every source it is opened by ``with``.

    Args:
        kind: of `SOURCE_KINDS`.
        settings: values of its keys, in SI, under their names without the unit.
        port: of a simulated kind, the port that its process plays on.

    Raises:
        SensorError: there is no such kind, or its row names nothing that can be imported.
    """
    if kind == GROUP:
        return SourceGroup([open_source(name, values) for name, values in settings["members"]])
    row = find_kind(kind)
    if row is None:
        raise SensorError(f"kind of a source must be one of {', '.join(SOURCE_KINDS)}, got {kind!r}")
    module, _, name = row.opener.partition(":")
    try:
        opener = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as exc:
        raise SensorError(
            f'the opener {row.opener!r} of a {kind} source cannot be loaded: {exc}; write "module:Class" in its row'
        ) from exc
    source: Source = opener(port=port) if row.simulated else opener(**settings)
    return source
