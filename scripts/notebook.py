"""Make the notebook of the tutorial from its page, which is the one text of both.

python scripts/notebook.py [--output docs/learn/first-collision.ipynb]

Commands become lines with "!", files that the page shows are written by %%writefile, and what the page does not run
stays text.
"""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "learn" / "first-collision.md"
TARGET = PAGE.with_suffix(".ipynb")
_BLOCK = re.compile(
    r'^(?:<!-- (not run): .*? -->\n)?```(\w+)(?: title="(.+?)")?\n(.*?)^```\n', re.DOTALL | re.MULTILINE
)
_FIRST = """\
import os
import sys
from pathlib import Path

# the commands below are those of the environment in which this notebook's kernel runs
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
"""


def notebook(page: str) -> str:
    """Return the notebook of a page, as JSON."""
    cells: list[tuple[str, str]] = []
    end = 0
    for block in _BLOCK.finditer(page):
        not_run, language, title, text = block.groups()
        cells.append(("markdown", page[end : block.start()]))
        end = block.end()
        if not_run:
            cells += [("markdown", f"```{language}\n{text}```"), ("code", _FIRST)]
        elif language == "sh":
            lines = text.splitlines()
            cells.append(
                ("code", "\n".join(f"!{line}" if line.startswith(("coneskin", "python")) else line for line in lines))
            )
        elif language == "toml":
            cells.append(("code", f"%%writefile {title}\n{text}"))
        else:
            cells.append(("code", text) if language == "python" else ("markdown", f"```{language}\n{text}```"))
    cells.append(("markdown", page[end:]))
    made = [_cell(number, kind, text.strip("\n")) for number, (kind, text) in enumerate(cells, 1) if text.strip()]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {"cells": made, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def _cell(number: int, kind: str, text: str) -> dict[str, object]:
    source = text.splitlines(keepends=True)
    cell: dict[str, object] = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": source}
    return {**cell, "execution_count": None, "outputs": []} if kind == "code" else cell


def main() -> None:
    """Write the notebook."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=TARGET)
    parser.parse_args().output.write_text(notebook(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
