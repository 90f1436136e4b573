"""Command ``coneskin unroll``: the flat sector of a truncated cone.

examples:
  coneskin unroll --radius1-mm 40 --radius2-mm 70 --height-mm 150
  coneskin unroll --radius1-mm 54 --height-mm 434 --wrap-deg 300 --json

One radius is enough for a cylinder.
r1 belongs to radius 1 and r2 to radius 2, so r1 > r2 where the link narrows. The sector of a cylinder is a rectangle:
r1 and r2 are infinite (null in JSON), theta0 is 0, and arc1 is the width.
Exit code: 0; 1 there is no such cone; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math

from coneskin.core.text import finite
from coneskin.geometry.frustum import unroll

from .dimensions import add_cone_options, given_cone


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add_cone_options(parser.add_argument)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Print the sector of the cone; the exit code is 0."""
    cone = given_cone(args)
    sector = unroll(cone)
    facts = {
        "r1_mm": 1e3 * sector.r1,
        "r2_mm": 1e3 * sector.r2,
        "theta0_deg": math.degrees(sector.theta0),
        "slant_mm": 1e3 * sector.slant,
        "half_angle_deg": math.degrees(cone.half_angle),
        "arc1_mm": 1e3 * sector.arc1,
        "arc2_mm": 1e3 * sector.arc2,
        "area_cm2": 1e4 * sector.area,
    }
    if args.json:
        print(json.dumps(finite(facts)))
        return 0
    for key, value in facts.items():
        name, unit = key.rsplit("_", 1)
        print(f"{name.replace('_', ' '):<11} {value:14.6f} {unit}")
    return 0
