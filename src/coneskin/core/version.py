"""Version of the code that runs: that of the package, its commit in a repository, and whether it is compiled."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

__version__ = "0.1.0"  # the one place: pyproject.toml reads it from here

_COMMIT_DIGITS = 7  # digits of a commit, for people
_HEADER_KEYS = ("coneskin", "commit", "build")  # of a recording


@cache
def _code_commit() -> str:
    """Return the commit that the code was checked out from, by the files of git; empty where it was installed."""
    git = Path(__file__).resolve().parents[3] / ".git"
    try:
        if git.is_file():  # a work tree of its own
            git = Path(git.read_text(encoding="utf-8").removeprefix("gitdir:").strip())
        head = (git / "HEAD").read_text(encoding="ascii").strip()
        if not head.startswith("ref: "):
            return head
        shared = git / "commondir"
        common = git / shared.read_text(encoding="utf-8").strip() if shared.is_file() else git
        name = head.removeprefix("ref: ")
        if (common / name).is_file():
            return (common / name).read_text(encoding="ascii").strip()
        packed = (common / "packed-refs").read_text(encoding="ascii").splitlines()
        return next((line.split()[0] for line in packed if line.endswith(f" {name}")), "")
    except (OSError, ValueError):
        return ""


def code_build() -> str:
    """Return what the live path and replays run as: ``compiled`` by mypyc, or ``pure`` Python. Both decide the same."""
    return "pure" if __file__.endswith((".py", ".pyc")) else "compiled"


def code_versions() -> dict[str, str]:
    """Return what a recording's header says of this code."""
    return dict(zip(_HEADER_KEYS, (__version__, _code_commit(), code_build()), strict=True))


def recorded_version(header: Mapping[str, Any]) -> str:
    """Return the version of code for people, such as ``0.1.0 (984714c, pure)``; empty where no version is told.

    It comes from what the code says of itself: the header of a recording, or ``code_versions``.
    """
    version, commit, build = (found if isinstance(found := header.get(key), str) else "" for key in _HEADER_KEYS)
    details = ", ".join(filter(None, (commit[:_COMMIT_DIGITS], build)))
    return f"{version} ({details})" if version and details else version
