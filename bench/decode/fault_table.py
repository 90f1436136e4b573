"""Table of bench `decode-faults`: its own section of bench/RESULTS-decode.md.

python -m bench decode-fault-table ANSWERS.json... [--write]
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from bench.report import head

__all__ = ["section"]

RESULTS = Path(__file__).with_name("RESULTS-decode.md")
HEADING = "## Faults of the virtual skin"
_LONGEST = ("frames", "latest")  # of several files the largest counts

Answers = dict[str, dict[str, int]]


def section(page: Path) -> str:
    """Return the section as it stands on a page; empty where there is none."""
    text = page.read_text() if page.exists() else ""
    return "\n" + text[text.index(HEADING) :] if HEADING in text else ""


def merge(files: list[Path]) -> Answers:
    """Return the answers of several runs as those of one."""
    found: Answers = {}
    for file in files:
        for name, row in json.loads(file.read_text()).items():
            known = found.setdefault(name, {})
            for key, value in row.items():
                if key.startswith("first"):
                    known.setdefault(key, value)
                else:
                    known[key] = max(known.get(key, 0), value) if key in _LONGEST else known.get(key, 0) + value
    return found


def table(found: Answers, drawn: str) -> str:
    """Return the section.

    Args:
        found: what was said of each fault.
        drawn: machine, commit, date.
    """
    lines, right, done, silent, late, timed = [], 0, 0, 0, 0, 0
    for fault, row in sorted(found.items()):
        verdicts = {k: v for k, v in row.items() if ": " in k and not k.startswith("first")}
        good = {k.removeprefix("right: "): v for k, v in verdicts.items() if k.startswith("right")}
        names = ", ".join(f"{k} {v}" for k, v in sorted(good.items(), key=lambda each: -each[1]))
        bad = {k: v for k, v in verdicts.items() if not k.startswith("right")}
        other = ", ".join(f"{k} ({v}, e.g. case {row['first ' + k]})" for k, v in bad.items())
        renamed = f"{row['renamed']}, in up to {row['frames']}" if "renamed" in row else ""
        behind = f"{row['late']} of {row['timed']}, by up to {row['latest']}" if "late" in row else ""
        cells = (fault, str(sum(verdicts.values())), str(sum(good.values())), names, renamed, behind, other)
        lines.append("| " + " | ".join(cells) + " |")
        right, done = right + sum(good.values()), done + sum(verdicts.values())
        silent += sum(v for k, v in bad.items() if k.startswith("silent"))
        late, timed = late + row.get("late", 0), timed + row.get("timed", 0)
    goals = (
        ("named correctly: 99.9 %", f"{100.0 * right / done:.2f} % of {done}", right >= 0.999 * done),
        ('none taken for "no touch"', f"{silent} of {done}", not silent),
        ("a touch shows on the frame on which a healthy sensor shows it", f"{timed - late} of {timed}", not late),
    )
    columns = "fault", "cases", "right", "last names", "renamed, frames", "touch shown late, frames", "otherwise"
    return "\n".join(
        [
            HEADING,
            "",
            "Printed by `python -m bench decode-faults` and `python -m bench decode-fault-table --write`.",
            "",
            drawn,
            "",
            "| goal | measured | met |",
            "| --- | --- | --- |",
            *(f"| {what} | {measured} | {'yes' if met else '**no**'} |" for what, measured, met in goals),
            "",
            "| " + " | ".join(columns) + " |",
            "|" + " --- |" * len(columns),
            *lines,
            "",
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("answers", nargs="+", type=Path, help="files of decode_faults.py")
    parser.add_argument("--write", action="store_true", help="put it into RESULTS-decode.md")
    args = parser.parse_args()
    text = table(merge(args.answers), head())
    print(text)
    if args.write:
        page = RESULTS.read_text()
        RESULTS.write_text(page.removesuffix(section(RESULTS)).rstrip("\n") + "\n\n" + text)
