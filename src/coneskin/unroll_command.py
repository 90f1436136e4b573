"""``coneskin unroll``: the flat sector of a truncated cone."""

from __future__ import annotations

import argparse
import json
import math

__all__ = ["add_arguments", "run"]

_EXAMPLE = """\
example:
  coneskin unroll --radius1-mm 40 --radius2-mm 70 --height-mm 150
  coneskin unroll --radius1-mm 54 --height-mm 434 --wrap-deg 300 --json     (a cylinder: one radius is enough)

r1 belongs to radius 1 and r2 to radius 2, so r1 > r2 where the link narrows. On a cylinder the sector is a rectangle:
r1 and r2 are infinite (null in JSON), theta0 is 0, and arc1 is its width.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--radius1-mm", type=float, required=True, help="radius of the link at end 1")
    parser.add_argument("--radius2-mm", type=float, help="radius at end 2 (default: radius 1, a cylinder)")
    parser.add_argument("--height-mm", type=float, required=True, help="distance of the ends along the axis")
    parser.add_argument("--wrap-deg", type=float, default=360.0, help="angle about the axis to cover (default 360)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Print the sector."""
    from .geometry.frustum import Frustum
    from .geometry.sector import unroll
    from .link_numbers import check_numbers

    values = check_numbers(args)
    cone = Frustum(values["radius1"], values.get("radius2", values["radius1"]), values["height"], values["wrap"])
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
        finite = {key: value if math.isfinite(value) else None for key, value in facts.items()}
        print(json.dumps(finite, allow_nan=False))
        return 0
    for key, value in facts.items():
        name, unit = key.rsplit("_", 1)
        print(f"{name.replace('_', ' '):<11} {value:14.6f} {unit}")
    return 0
