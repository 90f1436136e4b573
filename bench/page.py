"""Page of all results, bench/RESULTS.md, made from the JSON files in bench/results.

python -m bench page            # writes it
python -m bench page --check    # exit code 1 where it is not what the files make
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from bench.report import RESULTS, text_table
from bench.table import BENCHES

_PAGE_FILE = Path(__file__).with_name("RESULTS.md")
#: rows of a table on the page, of the usual run of a bench and of one with other options; the JSON file has all
_ROWS_SHOWN = 4
_OTHER_ROWS_SHOWN = 3
_LINES_SHOWN = 30  # of a run without a table
_PAGE_HEAD = """# Results

`python -m bench page` makes this page from the JSON files in `bench/results`. `python -m bench NAME --save` measures
again and writes one of them. The machines are small virtual ones with two shared cores. Compare the times of one table
with each other, not with those of your computer. No real arm and no real skin was measured.
"""


def page() -> str:
    """Return the text of the page."""
    runs: dict[str, list[tuple[Path, dict[str, Any]]]] = {}
    for file in sorted(RESULTS.glob("*.json")):
        run = json.loads(file.read_text(encoding="utf-8"))
        runs.setdefault(run["bench"], []).append((file, run))
    parts = [_PAGE_HEAD]
    for name in [*BENCHES, *sorted(set(runs) - set(BENCHES))]:
        for number, (file, run) in enumerate(sorted(runs.get(name, []), key=lambda each: len(each[0].name))):
            parts += [] if number else [f"## {name}\n"]
            parts.append(_run(file, run, _OTHER_ROWS_SHOWN if number else _ROWS_SHOWN))
        if name in runs:
            parts.append(f"Not shown: {runs[name][0][1]['not_shown']}\n")
    return "\n".join(parts)


def _run(file: Path, run: dict[str, Any], most: int) -> str:
    lines = [f"`{run['command']}`, {run['commit']}, {run['date']}, {run['machine']}", "", "```"]
    for number, table in enumerate(run.get("tables", ())):
        rows = table["rows"]
        lines += [*([""] if number else []), table["title"], text_table(table["columns"], rows[:most])]
        if len(rows) > most:
            lines.append(f"and {len(rows) - most} more in results/{file.name}")
    lines += [*run.get("printed", ())[:_LINES_SHOWN], "```", ""]
    lines += [f"{run['found']}\n"] if run.get("found") else []
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare the page with the files, and write nothing")
    args = parser.parse_args()
    text = page()
    if args.check:
        return int(not _PAGE_FILE.exists() or _PAGE_FILE.read_text(encoding="utf-8") != text)
    _PAGE_FILE.write_text(text, encoding="utf-8")
    print(f"{_PAGE_FILE.name}: {len(text.split())} words of {len(list(RESULTS.glob('*.json')))} files")
    return 0
