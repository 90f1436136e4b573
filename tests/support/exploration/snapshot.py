"""Snapshots of machines of plain objects, to go back to, of pure and of compiled code alike."""

from __future__ import annotations

import enum
import re
import types
from collections import deque
from dataclasses import is_dataclass
from functools import partial
from typing import Any

_SHARED: dict[type, bool] = {}
_ATTRIBUTES: dict[type, tuple[str, ...] | None] = {}
_PLAIN = (int, float, complex, bool, str, bytes, type(None), type, range, re.Pattern, frozenset)
_NOTHING = object()
Snapshot = list[tuple[Any, Any]]  #: of each object what it holds


def _is_shared(kind: type) -> bool:
    frozen = is_dataclass(kind) and kind.__dataclass_params__.frozen  # type: ignore[attr-defined]
    return frozen or issubclass(kind, _PLAIN) or issubclass(kind, (types.FunctionType, types.ModuleType, enum.Enum))


def _attributes(kind: type) -> tuple[str, ...] | None:
    """Return the names of a class's attributes; None where each object has a dictionary of its own."""
    if kind not in _ATTRIBUTES:
        names: list[str] = []
        for base in kind.__mro__:
            slots = base.__dict__.get("__slots__", ())
            names += [slots] if isinstance(slots, str) else list(slots)
            names += list(base.__dict__.get("__mypyc_attrs__", ()))
        known = tuple(dict.fromkeys(name for name in names if name not in ("__dict__", "__weakref__")))
        _ATTRIBUTES[kind] = known or None
    return _ATTRIBUTES[kind]


def save(root: Any, shared: frozenset[str] = frozenset()) -> Snapshot:
    """Return what all objects hold that a machine leads to; ``restore`` puts it back into the same objects.

    No object is made anew: a compiled class makes none without its arguments.

    Args:
        root: the machine.
        shared: names of classes that never change although they could.
    """
    found: dict[int, tuple[Any, Any]] = {}
    todo = [root]
    while todo:
        value = todo.pop()
        kind = type(value)
        known = _SHARED.get(kind)
        if known is None:
            known = _SHARED[kind] = _is_shared(kind) or kind.__name__ in shared
        if known or id(value) in found:
            continue
        held: Any
        if issubclass(kind, tuple):
            todo.extend(value)
            continue
        if kind is partial:
            todo += [value.func, *value.args]
            continue
        if kind is dict:
            held = dict(value)
            todo.extend(held.values())
        elif kind is bytearray:
            held = bytes(value)
        elif kind in (list, set, deque):
            held = tuple(value)
            todo.extend(held)
        elif hasattr(value, "__self__"):  # a method
            todo.append(value.__self__)
            continue
        elif (names := _attributes(kind)) is None:
            held = dict(value.__dict__)
            todo.extend(held.values())
        else:
            held = {name: getattr(value, name) for name in names if hasattr(value, name)}
            todo.extend(held.values())
        found[id(value)] = value, held
    return list(found.values())


def restore(saved: Snapshot) -> None:
    """Let all objects hold again what they held."""
    for value, held in saved:
        kind = type(value)
        if kind in (list, bytearray):
            value[:] = held
        elif kind in (dict, set):
            value.clear()
            value.update(held)
        elif kind is deque:
            value.clear()
            value.extend(held)
        elif _attributes(kind) is None:
            value.__dict__.clear()
            value.__dict__.update(held)
        else:
            for name, item in held.items():
                if getattr(value, name, _NOTHING) is not item:
                    setattr(value, name, item)
