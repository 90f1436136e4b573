"""Help of a command as wide as the terminal: paragraphs are filled, and what stands in columns keeps its columns."""

from __future__ import annotations

import argparse
import re
import textwrap

_MIN_COLUMN = 24  # letters that a second column needs, or else it goes on below the first


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Formatter of ``argparse`` that wraps descriptions and examples too; a command goes on behind a backslash."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs: list[str] = []
        open_before = False  # the line before goes on with this one
        for line in (indent + line for line in text.splitlines()):
            plain = bool(line.strip()) and not line.startswith(" ")
            if plain and open_before:
                paragraphs[-1] += " " + line
            else:
                paragraphs.append(line)
            open_before = plain and not line.endswith(":")
        return "\n".join(_wrapped(paragraph, width) for paragraph in paragraphs)


def _wrapped(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    indent = line[: len(line) - len(line.lstrip())] if len(line) - len(line.lstrip()) < width // 2 else " " * 6
    head, gap, tail = re.match(r"(\S.*?)(\s{2,}|$)(.*)", line.lstrip()).groups()  # type: ignore[union-attr]
    if not head.startswith(("coneskin ", "python ")) and (not gap or width - len(indent + head + gap) < _MIN_COLUMN):
        return _rows(f"{head} {tail}", width, indent, indent)
    column = len(indent + head + gap)
    if gap and width - column >= _MIN_COLUMN:
        return _rows(tail, width, indent + head + gap, " " * column)
    command = _rows(head, width - 2, indent, f"{indent}    ").replace("\n", " \\\n")
    return f"{command}\n{_rows(tail, width, *[f'{indent}    '] * 2)}" if tail else command


def _rows(text: str, width: int, first: str, others: str) -> str:
    made = textwrap.TextWrapper(width, first, others, break_long_words=False, break_on_hyphens=False)
    return made.fill(text)
