"""How many links a person gets sheets for: the whole command ``coneskin design`` on each mesh of a folder.

    python -m bench design-reach FOLDER               # every STL, DAE and OBJ in it, three sheets at most
    python -m bench design-reach FOLDER --keep FILE   # goes on where it ended

What became of each: the share of the hull's area that the sheets cover, and on which they locate a touch; or the last
line of what the command said. A
mesh is one of a maker's description, whatever part of the arm it is: bases, forks and flat wrists are among them.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from bench.report import head

SUFFIXES = (".stl", ".dae", ".obj")


def design(mesh: Path, seconds: float) -> dict[str, object]:
    """Return what became of a mesh: its name, exit code, time [s], number of sheets, covered share, last words."""
    row: dict[str, object] = {"name": mesh.name, "commit": head().splitlines()[1].split()[1].rstrip(",")}
    since = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "coneskin", "design", str(mesh), "-o", f"{folder}/out", "--max-sheets", "3"]
        try:
            done = subprocess.run(
                [*command, "--no-pictures", "--json"], capture_output=True, text=True, timeout=seconds, check=False
            )
        except subprocess.TimeoutExpired:
            return {**row, "code": "none", "s": seconds, "words": f"not done in {seconds:g} s"}
    row |= {"code": done.returncode, "s": round(time.monotonic() - since, 1)}
    if done.returncode:
        said = done.stderr.strip().splitlines()
        return {**row, "traceback": "Traceback" in done.stderr, "words": said[-1] if said else ""}
    found = json.loads(done.stdout)
    covered = sum(sheet["fit"]["area_share"] for sheet in found["sheets"])
    active = sum(sheet["fit"]["area_share"] * sheet["active_share"] for sheet in found["sheets"])
    return {**row, "sheets": len(found["sheets"]), "share": round(covered, 3), "active": round(active, 3)}


def main() -> None:
    """Design for every mesh, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--keep", type=Path, help="file of the rows, one JSON a line")
    parser.add_argument("--seconds", type=float, default=300.0, help="longest time for one mesh (300)")
    options = parser.parse_args()
    kept = options.keep.read_text().splitlines() if options.keep and options.keep.exists() else []
    rows = {row["name"]: row for row in map(json.loads, kept)}
    for mesh in sorted(path for path in options.folder.iterdir() if path.suffix.lower() in SUFFIXES):
        if mesh.name in rows:
            continue
        rows[mesh.name] = row = design(mesh, options.seconds)
        if options.keep:
            with options.keep.open("a") as file:
                file.write(json.dumps(row) + "\n")
    print(head("trimesh", "numpy", "scipy"))
    print(f"{'mesh':90s}{'sheets':>7s}{'share':>7s}{'active':>7s}{'s':>7s}  what it said")
    for name, row in sorted(rows.items()):
        sheets, share, active = (row.get(key, "-") for key in ("sheets", "share", "active"))
        print(f"{name[-89:]:90s}{sheets:>7}{share:>7}{active:>7}{row['s']:>7}  {row.get('words', '')}")
    shares = [float(str(row["active"])) for row in rows.values() if "active" in row]
    if shares:
        print(f"median active share of {len(shares)} designs: {statistics.median(shares):.3f}")
    codes = Counter(str(row["code"]) for row in rows.values())
    print(f"{len(rows)} meshes: " + ", ".join(f"exit {code}: {count}" for code, count in sorted(codes.items())))
    print(f"tracebacks: {sum(bool(row.get('traceback')) for row in rows.values())}")
