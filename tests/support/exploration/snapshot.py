"""Snapshots of machines of plain objects: copies that go on alone, of pure and of compiled code alike."""

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
_FUNCTIONS = (types.FunctionType, types.BuiltinFunctionType, types.ModuleType, enum.Enum)


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


def clone(value: Any, memo: dict[int, Any], shared: frozenset[str] = frozenset()) -> Any:
    """Return a copy that shares only what never changes.

    Args:
        value: to copy.
        memo: by identity, what was copied already; empty at first.
        shared: names of classes that never change although they could.
    """
    kind = type(value)
    known = _SHARED.get(kind)
    if known is None:
        known = _SHARED[kind] = _is_shared(kind) or kind.__name__ in shared
    if known:
        return value
    if kind is tuple or issubclass(kind, tuple):
        items = [clone(item, memo, shared) for item in value]
        if all(a is b for a, b in zip(items, value, strict=True)):
            return value
        return kind(items) if kind is tuple else kind(*items)
    made = memo.get(id(value))
    if made is not None:
        return made
    if kind is list:
        made = memo[id(value)] = []
        made.extend(clone(item, memo, shared) for item in value)
    elif kind is dict:
        made = memo[id(value)] = {}
        for name, item in value.items():
            made[name] = clone(item, memo, shared)
    elif kind is set:
        made = memo[id(value)] = set(value)
    elif kind is deque:
        made = memo[id(value)] = deque((clone(item, memo, shared) for item in value), value.maxlen)
    elif kind is bytearray:
        made = memo[id(value)] = bytearray(value)
    elif kind is partial:
        made = partial(clone(value.func, memo, shared), *(clone(item, memo, shared) for item in value.args))
    elif kind is types.MethodType:
        made = types.MethodType(value.__func__, clone(value.__self__, memo, shared))
    elif (owner := getattr(value, "__self__", None)) is not None and hasattr(value, "__name__"):
        return (
            value
            if isinstance(owner, (types.ModuleType, type))
            else getattr(clone(owner, memo, shared), value.__name__)
        )
    else:
        made = memo[id(value)] = kind.__new__(kind)
        names = _attributes(kind)
        for name in value.__dict__ if names is None else names:
            try:
                item = getattr(value, name)
            except AttributeError:
                continue
            setattr(made, name, clone(item, memo, shared))
    return made
