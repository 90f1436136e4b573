"""Options of ``coneskin design``, and what they ask for."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

from .design import Choices
from .errors import GeometryError
from .geometry.dxf import Arcs
from .geometry.electrodes import ElectrodePlan
from .geometry.forecast import Converter
from .geometry.frustum import Frustum
from .geometry.pdf import Page
from .geometry.pen import Side
from .geometry.placed import PlacedFrustum, double_cone
from .geometry.stack import PAPER_STACK, Assembly, Stack
from .link_numbers import check_numbers

__all__ = ["EXAMPLE", "add_arguments", "choices_of", "links_by_numbers", "refuse_numbers", "wrap_of"]

EXAMPLE = """\
examples:
  coneskin design upperarm.stl -o skin                 find the cones in a mesh (STL, OBJ, DAE, PLY)
  coneskin design ur10.urdf#upper_arm_link -o skin     the same for a link of a URDF
  coneskin design --radius1-mm 54 --height-mm 400 -o skin                                   a cylinder
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --wrap-deg 270 -o skin    a cone, partly wrapped
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --radius3-mm 40 --height2-mm 150 -o skin
                                                                                            a rugby ball: two sheets

The folder then holds report.md, sensor.toml, materials.csv, design.json, and cut/ with a DXF, SVG and PDF for every
layer. It appears whole or not at all.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.usage = "coneskin design [LINK] -o DIR [options]"
    parser.epilog = EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    add = parser.add_argument
    add("link", metavar="LINK", nargs="?", help="a mesh file or FILE.urdf#LINK; none where the radii are given")
    add("-o", "--output", metavar="DIR", required=True, type=Path, help="folder to make")
    add("--force", action="store_true", help="replace an earlier design there")
    add("--json", action="store_true", help="print the design as JSON")
    add("--no-pictures", action="store_true", help="leave the pictures out of the report")

    add = parser.add_argument_group("a link by numbers").add_argument
    add("--radius1-mm", type=float, help="radius at end 1")
    add("--radius2-mm", type=float, help="radius at end 2 (default: radius 1, a cylinder)")
    add("--height-mm", type=float, help="distance of the ends along the axis")
    add("--radius3-mm", type=float, help="far radius of a second cone on top of end 2")
    add("--height2-mm", type=float, help="height of the second cone")
    add("--wrap-deg", type=float, help="angle about the axis (default: 360, or what fits the mesh)")

    add = parser.add_argument_group("finding cones in a mesh").add_argument
    add("--unit", choices=("m", "cm", "mm", "inch"), help="unit of the mesh (default: guessed, and said)")
    add("--up-axis", choices=("ignore", "apply"), default="ignore", help="COLLADA's up axis (default ignore, as RViz)")
    add("--tolerance-mm", type=float, default=1.0, help="largest distance of sheet and mesh (default 1)")
    add("--max-sheets", type=int, default=2, help="at most so many sheets (default 2)")
    add("--shortest-mm", type=float, default=25.0, help="length below which a sheet is not worth while (default 25)")
    add("--narrowest-deg", type=float, default=150.0, help="smallest partial wrap (default 150)")
    add("--bridge-mm", type=float, default=10.0, help="widest hole or groove that a sheet spans (default 10)")
    seam = {"nargs": 3, "default": (1.0, 0.0, 0.0), "metavar": ("X", "Y", "Z")}
    add("--seam", type=float, help="direction in which the seam looks (default 1 0 0)", **seam)  # type: ignore[arg-type]

    add = parser.add_argument_group("layers, from the link outwards").add_argument
    five = {"nargs": 5, "metavar": ("LS", "LC", "I", "UC", "US")}
    thickness = " ".join(f"{layer.thickness * 1e3:g}" for layer in PAPER_STACK.layers)
    stiffness = " ".join(f"{layer.stiffness / 1e6:g}" for layer in PAPER_STACK.layers)
    add("--thickness-mm", type=float, help=f"of the five layers (default {thickness})", **five)  # type: ignore[arg-type]
    add("--material", help="names of the five materials (default: the paper's)", **five)  # type: ignore[arg-type]
    add("--neutral", type=float, help="K-factor of each layer, 0 inner to 1 outer face (default 0.5)", **five)  # type: ignore[arg-type]
    add("--stiffness-mpa", type=float, help=f"Young's moduli (default {stiffness})", **five)  # type: ignore[arg-type]
    add(
        "--assembly",
        choices=get_args(Assembly),
        default="loose",
        help="what is glued flat before wrapping: nothing, each conductive sheet to its substrate, or all "
        "(default loose)",
    )

    add = parser.add_argument_group("sheet").add_argument
    plan = ElectrodePlan()
    for name, text in (
        ("margin", "inactive rim outside the electrodes"),
        ("electrode", "width of the electrodes"),
        ("setback", "how much smaller the conductive sheets are"),
        ("lead", "width of leads and tabs"),
        ("clearance", "between leads and other foil"),
        ("tab", "how far tabs stick out, 0 for none"),
        ("hole", "diameter of the registration holes, 0 for none"),
    ):
        default = getattr(plan, name) * 1e3
        add(f"--{name}-mm", type=float, default=default, help=f"{text} (default {default:g})")
    add(
        "--wires",
        choices=get_args(Side),
        help="side where all four wires leave (default end1; end2 for the last of several sheets)",
    )
    add("--seam-gap-mm", type=float, default=0.0, help="how far the seam stays open (default 0)")
    add("--overlap-mm", type=float, default=0.0, help="flap of the upper substrate over the seam (default 0)")
    add("--sheet-gap-mm", type=float, default=1.0, help="least distance of neighbouring sheets (default 1)")

    add = parser.add_argument_group("drawings").add_argument
    add("--kerf-mm", type=float, default=0.0, help="width that the cutter takes away (default 0)")
    add("--arcs", choices=get_args(Arcs), default="bulge", help="arcs in DXF files (default bulge)")
    add("--cut-tolerance-mm", type=float, default=0.01, help="for flattened arcs and rectangles (default 0.01)")
    add("--page", choices=get_args(Page), default="A4", help="paper of the PDF files (default A4)")
    add("--face-up", choices=("work", "outside", "inside"), default="work", help="face that the drawings show")

    add = parser.add_argument_group("electronics").add_argument
    add("--adc-bits", type=int, default=12, help="resolution of the converter (default 12)")
    add("--adc-v", type=float, default=3.3, help="its range (default 3.3)")
    add("--supply-v", type=float, default=2.5, help="potential of the positive electrode (default 2.5)")
    add("--current-full-scale-ma", type=float, default=20.0, help="drive current of the highest count (default 20)")
    add("--upper-sheet-ohm", type=float, default=1000.0, help="ohm per square of the upper conductive layer (1000)")
    add("--lower-sheet-ohm", type=float, default=1000.0, help="ohm per square of the lower conductive layer (1000)")


def choices_of(args: argparse.Namespace) -> Choices:
    """What the sheets shall be."""
    layers = PAPER_STACK.layers
    for name, option, scale in (
        ("thickness", args.thickness_mm, 1e-3),
        ("material", args.material, None),
        ("neutral_factor", args.neutral, 1.0),
        ("stiffness", args.stiffness_mpa, 1e6),
    ):
        if option is not None:
            values = option if scale is None else [value * scale for value in option]
            a, b, c, d, e = (replace(layer, **{name: v}) for layer, v in zip(layers, values, strict=True))
            layers = (a, b, c, d, e)
    widths = ("margin", "electrode", "setback", "lead", "clearance", "tab", "hole")
    plan = ElectrodePlan(**{name: getattr(args, f"{name}_mm") * 1e-3 for name in widths})
    tolerance = args.cut_tolerance_mm * 1e-3
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise GeometryError(f"--cut-tolerance-mm must be finite and above 0 mm, got {args.cut_tolerance_mm!r}")
    return Choices(
        stack=Stack(layers, args.assembly),
        plan=plan,
        wires=args.wires,
        converter=Converter(args.adc_bits, args.adc_v, args.supply_v),
        upper_sheet_ohms=args.upper_sheet_ohm,
        lower_sheet_ohms=args.lower_sheet_ohm,
        current_full_scale=args.current_full_scale_ma * 1e-3,
        seam_gap=args.seam_gap_mm * 1e-3,
        overlap=args.overlap_mm * 1e-3,
        sheet_gap=args.sheet_gap_mm * 1e-3,
        kerf=args.kerf_mm * 1e-3,
        snap=tolerance,
        face_up=args.face_up,
    )


def wrap_of(args: argparse.Namespace) -> float | None:
    """The wrap asked for [rad], or None."""
    return check_numbers(argparse.Namespace(wrap_deg=args.wrap_deg)).get("wrap")


def links_by_numbers(args: argparse.Namespace) -> tuple[PlacedFrustum, ...]:
    """The places that the radii and heights describe."""
    if args.radius1_mm is None or args.height_mm is None:
        raise GeometryError("name a mesh file, or give --radius1-mm and --height-mm")
    if (args.radius3_mm is None) != (args.height2_mm is None):
        raise GeometryError("a second cone needs both --radius3-mm and --height2-mm")
    values = check_numbers(args)
    wrap = values.get("wrap", 2.0 * math.pi)
    radius1, height = values["radius1"], values["height"]
    radius2 = values.get("radius2", radius1)
    if "radius3" not in values:
        return (PlacedFrustum(Frustum(radius1, radius2, height, wrap)),)
    return double_cone(radius1, radius2, values["radius3"], height, values["height2"], wrap)


def refuse_numbers(args: argparse.Namespace) -> None:
    """Refuse radii and heights beside a mesh."""
    given = [name for name in ("radius1", "radius2", "height", "radius3", "height2") if getattr(args, f"{name}_mm")]
    if given:
        raise GeometryError(f"a mesh and --{given[0]}-mm cannot go together: the radii are found in the mesh")
