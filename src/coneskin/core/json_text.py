"""JSON of recordings and files that anybody may have written: whatever is wrong with it is a ValueError."""

from __future__ import annotations

import json
import re
from typing import Any

__all__ = ["read_json"]

_DIGITS = 100  # a longer whole number is none that anything counts; as int it would overflow where it meets a float
_SURROGATE = re.compile(rb"\\u[dD][89a-fA-F]")


def read_json(data: bytes) -> Any:
    r"""Return the value of a JSON text, in which each string can be written as UTF-8.

    Half a pair of UTF-16, as in the name of a file that is no UTF-8, is written out: six letters such as ``\udcff``.
    Whole numbers of over 100 digits are floats, infinite above 1.8e308.

    Raises:
        ValueError: it is no JSON, no UTF-8, or nested too deep.
    """
    try:
        value = json.loads(data.decode("utf-8-sig"), parse_int=_whole)
        return _written_out(value) if _SURROGATE.search(data) else value
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits.lstrip("-")) <= _DIGITS else float(digits)


def _written_out(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, list):
        return [_written_out(item) for item in value]
    if isinstance(value, dict):
        return {_written_out(name): _written_out(item) for name, item in value.items()}
    return value
