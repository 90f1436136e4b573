"""Completion of commands and options in a shell, by argcomplete: the shell asks `coneskin` for the words."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence

from coneskin.core.errors import MissingExtra

__all__ = ["SHELLS", "complete", "completed_words", "shell_code"]

SHELLS = ("bash", "zsh", "fish", "powershell")
_ASKED = "_ARGCOMPLETE"  # set by the code of the shell
_LINE = "COMP_LINE"  # what was typed so far


def completed_words() -> Sequence[str] | None:
    """Return the words typed so far after the program's name, where a shell asks for a completion; else None."""
    return os.environ.get(_LINE, "").split()[1:] if _ASKED in os.environ else None


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell and end the process; return where argcomplete is not installed."""
    try:
        import argcomplete
    except ImportError:
        return
    argcomplete.autocomplete(parser)


def shell_code(shell: str) -> str:
    """Return what a shell runs at its start, so that it completes the words of `coneskin`.

    Raises:
        MissingExtra: argcomplete is not installed.
    """
    try:
        from argcomplete.shell_integration import shellcode
    except ImportError as exc:
        raise MissingExtra("argcomplete", "completion in a shell", "completion") from exc
    return str(shellcode(["coneskin"], shell=shell))
