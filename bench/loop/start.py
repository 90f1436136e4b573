"""Time from ``guard(scene)`` until the guard is active, with a virtual skin and no arm.

    python -m bench start [--times 10] [--other PATH]

``--other`` is the root of another checkout: the two take turns, so that a busy machine is as busy for both.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

_SCENE = """
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
[source]
kind = "virtual"
"""
_RUN = f"""
import time
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
scene = parse_scene({_SCENE!r})
began = time.monotonic()
with guard(scene):
    print(time.monotonic() - began)
"""


def start(root: Path) -> float:
    environment = {**os.environ, "PYTHONPATH": str(root / "src")}
    done = subprocess.run([sys.executable, "-c", _RUN], env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=10, help="starts of each (%(default)s)")
    parser.add_argument("--other", type=Path, help="root of a checkout to compare with")
    args = parser.parse_args()
    roots = [Path(__file__).parents[2], *([args.other.resolve()] if args.other else [])]
    times: dict[Path, list[float]] = {root: [] for root in roots}
    for _ in range(args.times):
        for root in roots:
            times[root].append(start(root))
    for root, found in times.items():
        print(f"{root.name}: median {statistics.median(found):.2f} s, fastest {min(found):.2f} s")
    if args.other:
        here, other = (statistics.median(times[root]) for root in roots)
        print(f"ratio of the medians {here / other:.2f}")
