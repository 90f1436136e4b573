"""State of a guard, all of it, as values that two guards can be compared by: every bit of every number."""

import types
from collections import deque
from typing import Any

_PLAIN = (int, str, bytes, bool, type(None))
_CODE = (types.FunctionType, types.MethodType, types.BuiltinFunctionType, type)


def state_of(item: Any, seen: dict[int, int] | None = None) -> Any:
    """Return what an object is made of, down to numbers and texts."""
    seen = {} if seen is None else seen
    if isinstance(item, _PLAIN):
        return item
    if isinstance(item, float):
        return item.hex()
    if id(item) in seen:
        return ("again", seen[id(item)])
    seen[id(item)] = len(seen)
    if isinstance(item, dict):
        return {str(key): state_of(value, seen) for key, value in item.items()}
    if isinstance(item, list | tuple | deque):
        return [state_of(value, seen) for value in item]
    if isinstance(item, set | frozenset):
        return sorted(map(repr, item))
    if isinstance(item, _CODE):
        return item.__qualname__
    names = list(getattr(item, "__dict__", {}))
    for kind in type(item).__mro__:
        slots = kind.__dict__.get("__slots__", ())
        names += [slots] if isinstance(slots, str) else list(slots)
    return {name: state_of(getattr(item, name), seen) for name in names if hasattr(item, name)}
