"""Pictures in docs/images that a page's own command draws, in a folder with the scenes of the page, and the demo's.

python scripts/draw_command_pictures.py [--output docs/images] [--only calibration,commissioning,demo]
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: name of the picture -> page, and the file that its command draws
PICTURES = {
    "calibration": ("docs/do/calibrate.md", "residuals.png"),
    "commissioning": ("docs/do/commission.md", "marks.png"),
}
_CALM_COMMAND = 15.0  # ms from the touch to the stop; a busy computer takes longer
_MOST_DEMOS = 10
_SCENE = re.compile(r'^```toml title="([\w.-]+)"\n(.*?)^```', re.DOTALL | re.MULTILINE)


def draw(page: Path, made: str, target: Path) -> None:
    """Run the command of a page that draws a file, and take the file.

    Args:
        page: of the documentation.
        made: the file, as the command names it.
        target: of the picture.
    """
    text = page.read_text(encoding="utf-8")
    (command,) = [line for line in text.splitlines() if line.startswith("coneskin ") and f"--picture {made}" in line]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, scene in reversed(_SCENE.findall(text)):  # of several with one name the first is the page's own
            (folder / title).write_text(scene, encoding="utf-8")
        words = [sys.executable, "-m", *shlex.split(command, comments=True)]
        subprocess.run(words, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        target.write_bytes((folder / made).read_bytes())


def draw_demo(target: Path) -> None:
    """Run the demo until this computer has not held it up, and take the picture of its run."""
    for _ in range(_MOST_DEMOS):
        with tempfile.TemporaryDirectory() as name:
            words = [sys.executable, "-m", "coneskin", "demo", "--output", f"{name}/demo", "--json"]
            subprocess.run(words, stdout=subprocess.DEVNULL)
            folder = Path(name) / "demo"
            facts = json.loads((folder / "summary.json").read_text()) if (folder / "summary.json").exists() else {}
            if facts.get("command_ms", 99.0) < _CALM_COMMAND and not facts["cut_short"]:
                target.write_bytes((folder / "run.png").read_bytes())
                return
    sys.exit(f"in {_MOST_DEMOS} runs the stop never went out within {_CALM_COMMAND} ms: leave this computer alone")


def main() -> None:
    """Draw the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "images")
    parser.add_argument("--only", default=",".join([*PICTURES, "demo"]))
    args = parser.parse_args()
    for name in args.only.split(","):
        if name == "demo":
            draw_demo(args.output / "demo.png")
            continue
        page, made = PICTURES[name]
        draw(ROOT / page, made, args.output / f"{name}.png")


if __name__ == "__main__":
    main()
