"""Time from ``guard(scene)`` until the guard is active, with a virtual skin and no arm.

python -m bench start [--times 10]
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys

from bench.report import head, show

_SCENE_TEXT = """
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
[source]
kind = "virtual"
"""
_START_PROGRAM = f"""
import time
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
scene = parse_scene({_SCENE_TEXT!r})
began = time.monotonic()
with guard(scene):
    print(time.monotonic() - began)
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=10, help="starts (%(default)s)")
    args = parser.parse_args()
    done = (
        subprocess.run([sys.executable, "-c", _START_PROGRAM], capture_output=True, text=True, check=True)
        for _ in range(args.times)
    )
    times = [float(each.stdout) for each in done]
    print(head())
    show(
        "s until the guard is active", ["median", "fastest"], [[f"{statistics.median(times):.2f}", f"{min(times):.2f}"]]
    )
