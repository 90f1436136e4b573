"""Force on a hand by how hard the stop brakes: `coneskin impact` with the scene of docs/do/impact.md.

    python -m bench impact-braking [--scene SCENE] [--rad-s2 10 20 40]

The scene is that of the page, or a file of one's own; each line has another deceleration_rad_s2 in it and is what
``coneskin impact SCENE --ways stop --json`` says.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.report import head, show

_PAGE = Path(__file__).parents[2] / "docs" / "do" / "impact.md"
_SCENE_BLOCK = re.compile(r'```toml title="scene\.toml"\n(.*?)```', re.DOTALL)
_DECELERATION_LINE = re.compile(r"^deceleration_rad_s2 = .*$", re.MULTILINE)
_COLUMN_FACTORS = {
    "approach": 1.0,
    "peak": 1.0,
    "clamp": 1.0,
    "impulse": 1.0,
    "depth": 1e3,
    "noticed": 1e3,
    "standstill": 1e3,
}
_COLUMN_UNITS = ("m/s", "N", "N", "Ns", "mm", "ms", "ms")


def page_scene() -> str:
    """Return the scene of the page."""
    found = _SCENE_BLOCK.search(_PAGE.read_text(encoding="utf-8"))
    if found is None:
        raise SystemExit(f"{_PAGE} has no block scene.toml")
    return found[1]


def strike(scene: str, deceleration: float) -> dict[str, float]:
    """Return what `coneskin impact` says of a scene whose stop brakes so [rad/s^2]."""
    text, changed = _DECELERATION_LINE.subn(f"deceleration_rad_s2 = {deceleration}", scene)
    if changed != 1:
        raise SystemExit(f"the scene must have one line deceleration_rad_s2, has {changed}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "coneskin", "impact", str(path), "--ways", "stop", "--json"]
        answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found: dict[str, float] = json.loads(answer)["stop"]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=Path, help="a file (the scene of docs/do/impact.md)")
    parser.add_argument("--rad-s2", type=float, nargs="+", default=[10.0, 20.0, 40.0])
    args = parser.parse_args()
    scene = args.scene.read_text(encoding="utf-8") if args.scene else page_scene()
    print(head("mujoco"))
    rows = []
    for deceleration in args.rad_s2:
        found = strike(scene, deceleration)
        cells = (f"{factor * found[name]:.{2 if factor == 1.0 else 1}f}" for name, factor in _COLUMN_FACTORS.items())
        rows.append([f"{deceleration:g}", *cells])
    columns = [f"{name} {unit}" for name, unit in zip(_COLUMN_FACTORS, _COLUMN_UNITS, strict=True)]
    show("a stop of each deceleration", ["rad/s2", *columns], rows)
