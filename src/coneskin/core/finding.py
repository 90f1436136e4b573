"""Findings of an examination: one line for each thing that was looked at, with what it should be and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "warning", "bad", "not tried"]


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of looking at one thing."""

    item: str  #: what was looked at
    verdict: Verdict  #: "bad": a guard refuses it, or goes wrong with it; "warning": it works, and not as it should
    value: str  #: what was found; for "not tried", why
    rule: str = ""  #: what it should be
    remedy: str = ""  #: what to do; empty where there is nothing

    @property
    def line(self) -> str:
        """What was found, and what to do, without item and verdict."""
        return f"{self.value}: {self.remedy}" if self.remedy else self.value

    @property
    def text(self) -> str:
        """Return it for people, in one line or two."""
        line = f"{self.verdict:>9}  {self.item}: {self.value}"
        wanted = "wanted: " if self.verdict in {"bad", "warning"} else ""  # else it reads as what was found
        line += f" ({wanted}{self.rule})" if self.rule else ""
        return f"{line}\n{'':9}  -> {self.remedy}" if self.remedy else line


def judged(item: str, verdict: Verdict | bool, value: str, rule: str, remedy: str) -> Finding:
    """Return a finding, without the remedy where nothing is wrong; for the verdict, True is "ok" and False "bad"."""
    word: Verdict = "ok" if verdict is True else "bad" if verdict is False else verdict
    return Finding(item, word, value, rule, "" if word == "ok" else remedy)
