"""Hint at the next command, for a person to copy into a shell."""

from __future__ import annotations

import sys

__all__ = ["print_hint"]


def print_hint(text: str) -> None:
    """Print a line with a command, unless what is pasted would be another one.

    Where the terminal's encoding lacks a letter of a file's name, the letter is written out as an escape; a control
    character in a name is one, too. No shell reads either as the file, so the line is left out.

    Args:
        text: the line; its file names are quoted for a shell.
    """
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return
    if text.isprintable():
        print(text, flush=True)
