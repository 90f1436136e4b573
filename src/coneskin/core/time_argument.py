"""Time of an option on the command line."""

from __future__ import annotations

import argparse

__all__ = ["positive_seconds"]


def positive_seconds(text: str) -> float:
    """Return the time in a word [s]; for ``type`` of an option.

    Raises:
        ArgumentTypeError: it is no number above 0; the message says so.
    """
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0, such as 2.5, got {text!r}")
    return value
