"""Time and memory of the whole command ``coneskin design`` on a link of many faces.

    python -m bench design-time LINK              # three sheets, no pictures; its edges halved once and three times
    python -m bench design-time --halvings 2 LINK

Each halving puts a corner amid every edge, so the surface stays as it is and has four times as many faces. The command
runs as a process of its own; processor seconds hold beside other work better than those of the clock, and the load is
printed.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.report import head
from coneskin.geometry.mesh import load_mesh


def write_fine(link: Path, halvings: int, file: Path) -> int:
    """Write a link with its edges halved so many times as binary STL in metres; return the number of faces."""
    corners = load_mesh(link).triangles
    for _ in range(halvings):
        a, b, c = corners.transpose(1, 0, 2)
        d, e, f = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        corners = np.concatenate([np.stack(part, 1) for part in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))])
    rows = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("kind", "<u2")]))
    rows["corners"] = corners
    file.write_bytes(bytes(80) + len(rows).to_bytes(4, "little") + rows.tobytes())
    return len(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("link", type=Path, metavar="LINK")
    parser.add_argument("--halvings", type=int, action="append", help="of the edges (default 1 and 3)")
    arguments = parser.parse_args()
    print(head("numpy", "scipy", "trimesh", "embreex"))
    print(f"{'faces':>9}{'':>13}{'clock s':>9}{'cpu s':>8}{'MB':>7}{'sheets':>8}")
    for halvings in arguments.halvings or (1, 3):
        with tempfile.TemporaryDirectory() as folder:
            faces = write_fine(arguments.link, halvings, Path(folder, "link.stl"))
            for words in ([], ["--set", "search.round_only=true"]):
                out = Path(folder, f"out{len(words)}")
                command = [sys.executable, "-m", "coneskin", "design", str(Path(folder, "link.stl")), "-o", str(out)]
                start = time.perf_counter()
                with open(Path(folder, "said"), "w", encoding="utf-8") as said:
                    run = subprocess.Popen(
                        [*command, "--max-sheets", "3", "--no-pictures", *words], stdout=said, stderr=said
                    )
                    _, status, used = os.wait4(run.pid, 0)
                spent = time.perf_counter() - start
                if status:
                    raise SystemExit(Path(folder, "said").read_text(encoding="utf-8"))
                sheets = len(list(out.glob("**/sensor.toml")))
                print(
                    f"{faces:9}{' '.join(words):>13}{spent:9.2f}{used.ru_utime + used.ru_stime:8.2f}"
                    f"{used.ru_maxrss / 1024:7.0f}{sheets:8}",
                    flush=True,
                )
