"""JSON of recordings and files that anybody may have written: whatever is wrong with it is a ValueError."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["read_json"]

_DIGITS = 100  # a longer whole number is none that anything counts; as int it would overflow where it meets a float


def read_json(data: bytes | str) -> Any:
    """Return the value of a JSON text; whole numbers of over 100 digits are floats, infinite above 1.8e308.

    Raises:
        ValueError: it is no JSON, no UTF-8, or nested too deep.
    """
    try:
        return json.loads(data, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits.lstrip("-")) <= _DIGITS else float(digits)
