"""Options of ``coneskin design`` for the printed jig."""

from __future__ import annotations

import argparse
from typing import get_args

from coneskin.design.sheets.jig_plan import JigPlan, JigSurface

__all__ = ["add_jig_options", "given_jig"]

#: lengths of a JigPlan that are options, and their help texts
_LENGTHS = {
    "wall": "thickness of the wall",
    "clearance": "gap to link and sheet",
    "reach": "length over the sheet",
    "grip": "length on the link",
}


def add_jig_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument_group("printed jig: collars that hold the ends of a sheet at their places").add_argument
    plan = JigPlan()
    add(
        "--jig",
        choices=get_args(JigSurface),
        default=plan.surface,
        help="what the collars lie on: the link's own surface, or its cone where there is no mesh (link), always the "
        "cone (cone); or no jig (none) (default link)",
    )
    for name, text in _LENGTHS.items():
        default = getattr(plan, name) * 1e3
        add(f"--jig-{name}-mm", type=float, default=default, metavar="MM", help=f"{text} (default {default:g})")
    add("--jig-parts", type=int, default=plan.parts, metavar="N", help=f"parts of a collar (default {plan.parts})")


def given_jig(args: argparse.Namespace) -> JigPlan:
    """Return the jig that the arguments describe.

    Raises:
        GeometryError: a value is out of range.
    """
    lengths = {name: getattr(args, f"jig_{name}_mm") * 1e-3 for name in _LENGTHS}
    return JigPlan(args.jig, parts=args.jig_parts, **lengths)
