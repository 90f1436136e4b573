"""Command-line options of ``coneskin design``, and the design that they describe."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import DesignOptions, JigPlan, JigSurface
from coneskin.geometry.drawing.cut_sheet import FaceUp
from coneskin.geometry.drawing.dxf import ArcStyle
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.drawing.layer_stack import PAPER_STACK, AssemblyMode, LayerStack
from coneskin.geometry.drawing.pdf import PageSize
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.scene.tables.sensor_keys import DOUBLE_CONE_KEYS, SENSOR_KEYS
from coneskin.skin.electronics import GivenElectronics

from .dimensions import add_dimension_options, add_setting_option, given_dimensions, option_name

__all__ = [
    "EXAMPLES",
    "add_arguments",
    "add_jig_options",
    "design_options",
    "given_jig",
    "links_from_dimensions",
    "package_folders",
    "refuse_dimensions",
    "requested_wrap",
    "seam_direction",
    "xacro_arguments",
]

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


def package_folders(args: argparse.Namespace) -> dict[str, str]:
    """Return the folders of ROS packages that were named.

    Raises:
        GeometryError: one is not NAME=DIR.
    """
    return _pairs(args.package, "--package takes NAME=DIR, as in --package ur_description=src/ur_description")


def xacro_arguments(args: argparse.Namespace) -> dict[str, str]:
    """Return the arguments of a xacro file.

    Raises:
        GeometryError: one is not NAME=VALUE.
    """
    return _pairs(args.xacro_arg, "--xacro-arg takes NAME=VALUE, as in --xacro-arg ur_type=ur5e")


def _pairs(texts: list[str], rule: str) -> dict[str, str]:
    pairs = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise GeometryError(f"{rule}: {text}")
        pairs[name] = value
    return pairs


def requested_wrap(args: argparse.Namespace) -> float | None:
    """Return the wrap angle asked for [rad]; None for the widest that fits."""
    return given_dimensions(args, [key for key in DOUBLE_CONE_KEYS if key.plain == "wrap"]).get("wrap")


def seam_direction(args: argparse.Namespace) -> tuple[float, float, float] | None:
    """Return the direction in which the seam of a full wrap faces; None for where the link shields it most.

    Raises:
        GeometryError: it was given twice.
    """
    if args.seam is not None and args.touch_side is not None:
        raise GeometryError("--seam and --touch-side cannot go together: the seam faces away from the touch side")
    for option, way in (("--seam", args.seam), ("--touch-side", args.touch_side)):
        if way is not None and not 0.0 < math.hypot(*way) < math.inf:
            raise GeometryError(
                f"{option} takes a direction X Y Z, finite and not 0 0 0, got {' '.join(map(str, way))}"
            )
    if args.seam is None and args.touch_side is None:
        return None
    x, y, z = args.seam or (-value for value in args.touch_side)
    return x, y, z


def links_from_dimensions(args: argparse.Namespace) -> tuple[PlacedFrustum, ...]:
    """Return the one or two places on a link that its radii and heights describe, in order along the axis.

    Raises:
        GeometryError: a dimension is missing or out of range.
    """
    values = given_dimensions(args, DOUBLE_CONE_KEYS)
    for option in ("seam", "touch_side"):
        if getattr(args, option) is not None:
            raise GeometryError(
                f"--{option.replace('_', '-')} is for a mesh: by its dimensions a link has no directions, and its seam "
                "is at phi = 0"
            )
    if args.weights is not None or args.exposure:
        option = "--exposure" if args.exposure else "--weights"
        raise GeometryError(f"{option} is for a mesh: a link by its dimensions is covered whole")
    if not {"radius1", "height"} <= values.keys():
        raise GeometryError("name a mesh file, or give --radius1-mm and --height-mm")
    if ("radius3" in values) != ("height2" in values):
        raise GeometryError("a second cone needs both --radius3-mm and --height2-mm")
    values = {"radius2": values["radius1"], **values}
    if "radius3" not in values:
        return (PlacedFrustum(Frustum(**values)),)
    wrap = values.get("wrap", 2.0 * math.pi)
    return double_cone(
        values["radius1"], values["radius2"], values["radius3"], values["height"], values["height2"], wrap
    )


def refuse_dimensions(args: argparse.Namespace) -> None:
    """Refuse radii and heights beside a mesh.

    Raises:
        GeometryError: one was given.
    """
    for key in DOUBLE_CONE_KEYS:
        if key.plain != "wrap" and getattr(args, key.name) is not None:
            raise GeometryError(f"a mesh and {option_name(key)} cannot go together: the radii are found in the mesh")


EXAMPLES = """\
examples:
  coneskin design upperarm.stl -o skin                 find the cones in a mesh (STL, OBJ, DAE, PLY)
  coneskin design ur10.urdf#upper_arm_link -o skin     the same for a link of a URDF
  coneskin design --radius1-mm 54 --height-mm 400 -o skin                                   a cylinder
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --wrap-deg 270 -o skin    a partial wrap of a cone
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --radius3-mm 40 --height2-mm 150 -o skin
                                                                                            a rugby ball: two sheets

The folder then holds report.md, sensor.toml, materials.csv, design.json, and cut/ with a DXF, SVG and PDF file for
every layer. If the command fails, no folder is left. Exit code: 0 written; 3 no cone fits the mesh; 1 another failure;
2 wrong usage.
"""


#: keys of a sensor that are options of the command
_ELECTRONICS = (
    *("supply_v", "adc_v", "adc_bits", "pulldown_ohm", "current_full_scale_ma"),
    *("upper_sheet_ohm", "lower_sheet_ohm"),
)
#: those that have a default in a scene, but are chosen for a design
_CHOSEN_HERE = ("upper_sheet_ohm", "lower_sheet_ohm")
#: fields of an ElectrodePlan that are options of the command, and their help texts
_WIDTHS = {
    "margin": "inactive rim outside the electrodes",
    "electrode": "width of the electrodes",
    "setback": "distance of the conductive sheets from the rim",
    "lead": "width of leads and tabs",
    "clearance": "distance between leads and other foil",
    "tab": "length of the tabs beyond the rim, 0 for none",
    "hole": "diameter of the registration holes, 0 for none",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.usage = "coneskin design [LINK] -o DIR [options]"
    parser.epilog = EXAMPLES
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    add = parser.add_argument
    add("link", metavar="LINK", nargs="?", help="mesh file or FILE.urdf#LINK; leave it out and give radii instead")
    add("-o", "--output", metavar="DIR", required=True, type=Path, help="folder to create")
    add("--force", action="store_true", help="replace an earlier design in that folder")
    add("--json", action="store_true", help="print the design as JSON")
    add("--no-pictures", action="store_true", help="write the report without pictures")

    add = parser.add_argument_group("a link by its dimensions").add_argument
    defaults = {"radius2": "radius 1, a cylinder", "wrap": "360, or the widest that fits the mesh"}
    add_dimension_options(add, DOUBLE_CONE_KEYS, defaults=defaults)

    add = parser.add_argument_group("finding cones in a mesh").add_argument
    add("--unit", choices=("m", "cm", "mm", "inch"), help="unit of the mesh (default: guessed and reported)")
    add(
        "--up-axis",
        choices=("ignore", "apply"),
        default="ignore",
        help="treatment of the up axis of a COLLADA file (default ignore, as in RViz)",
    )
    add(
        "--package",
        action="append",
        default=[],
        metavar="NAME=DIR",
        help="folder of a ROS package that a URDF names (package://NAME/...); may be repeated",
    )
    add(
        "--xacro-arg",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="argument of a xacro file, which is expanded (extra xacro); may be repeated",
    )
    _add_quantity(add, "tolerance-mm", 1.0, "largest distance between sheet and mesh")
    add("--max-sheets", type=int, default=2, metavar="N", help="largest number of sheets (default 2)")
    add("--round-only", action="store_true", help="use cones only, no sides of another section")
    add("--allow-hull", action="store_true", help="take a convex mesh of few faces: it is the link, no collision hull")
    add("--max-wires", type=int, metavar="N", help="largest number of wires, four for each sheet (default: any)")
    _add_quantity(add, "min-length-mm", 25.0, "smallest length of a sheet along the axis")
    _add_quantity(add, "min-wrap-deg", 150.0, "smallest partial wrap")
    _add_quantity(add, "max-bridge-mm", 10.0, "widest hole or groove that a sheet spans")
    seam = {"nargs": 3, "metavar": ("X", "Y", "Z")}
    text = "direction in which the seam faces, as the cable (default: where the link shields it most)"
    add("--seam", type=float, help=text, **seam)  # type: ignore[arg-type]
    add("--touch-side", type=float, help="side on which touches are likely: the seam faces away from it", **seam)  # type: ignore[arg-type]
    add("--weights", type=Path, metavar="FILE", help="cover what counts: CSV with x_mm,y_mm,z_mm,weight of places")
    add("--exposure", action="store_true", help="cover what can be touched: areas count by the free space above them")

    add = parser.add_argument_group(
        "layers, from the link outwards: lower substrate (LS), lower conductive (LC), isolation (I), "
        "upper conductive (UC), upper substrate (US)"
    ).add_argument
    five = {"nargs": 5, "metavar": ("LS", "LC", "I", "UC", "US")}
    thickness = " ".join(f"{layer.thickness * 1e3:g}" for layer in PAPER_STACK.layers)
    stiffness = " ".join(f"{layer.stiffness / 1e6:g}" for layer in PAPER_STACK.layers)
    add("--thickness-mm", type=float, help=f"thicknesses (default {thickness})", **five)  # type: ignore[arg-type]
    add("--material", help="names of the materials (default: those of the paper)", **five)  # type: ignore[arg-type]
    add("--neutral", type=float, help="K-factors, 0 inner to 1 outer face (default 0.5)", **five)  # type: ignore[arg-type]
    add("--stiffness-mpa", type=float, help=f"Young's moduli (default {stiffness})", **five)  # type: ignore[arg-type]
    add(
        "--assembly",
        choices=get_args(AssemblyMode),
        default="loose",
        help="layers glued together flat, before wrapping: none (loose), each conductive sheet to its substrate "
        "(pairs), or all (bonded) (default loose)",
    )

    add = parser.add_argument_group("sheet").add_argument
    plan = ElectrodePlan()
    for name, text in _WIDTHS.items():
        _add_quantity(add, f"{name}-mm", getattr(plan, name) * 1e3, text)
    add(
        "--wires",
        choices=get_args(SheetSide),
        help="side where all four wires leave (default end1; end2 for the last of several sheets on one axis)",
    )
    _add_quantity(add, "connector-mm", 60.0, "distance of the wires' connector from the rim")
    _add_quantity(add, "seam-gap-mm", 0.0, "gap of the seam of a full wrap")
    _add_quantity(add, "overlap-mm", 0.0, "width of a flap of the upper substrate over the seam")
    add("--cover-seam", action="store_true", help="close the blind seam of each full wrap by a strip, a sensor on top")
    _add_quantity(add, "sheet-gap-mm", 1.0, "smallest distance between neighbouring sheets")

    add = parser.add_argument_group("drawings").add_argument
    _add_quantity(add, "kerf-mm", 0.0, "width of the cut")
    size = {"nargs": 2, "metavar": ("WIDTH", "DEPTH"), "default": (600.0, 400.0)}
    add("--bed-mm", type=float, help="bed of the cutter, on which parts are nested (default 600 400)", **size)  # type: ignore[arg-type]
    _add_quantity(add, "bed-gap-mm", 3.0, "gap between nested parts")
    add("--step", action="store_true", help="write the wrapped layers as a STEP file too (extra cad)")
    add("--arcs", choices=get_args(ArcStyle), default="bulge", help="style of arcs in DXF files (default bulge)")
    _add_quantity(add, "cut-tolerance-mm", 0.01, "tolerance of flattened arcs, and of patterns cut as rectangles")
    add("--page", choices=get_args(PageSize), default="A4", help="paper size of the PDF files (default A4)")
    add(
        "--face-up",
        choices=get_args(FaceUp),
        default="work",
        help="face that is up in the drawings; work: the one on which the next part is glued (default work)",
    )

    add_jig_options(parser)
    add = parser.add_argument_group("electronics").add_argument
    for key in SENSOR_KEYS:
        if key.name in _ELECTRONICS:
            chosen = key.name in _CHOSEN_HERE
            add_setting_option(add, replace(key, default=None) if chosen else key)


def _add_quantity(add: Callable[..., Any], name: str, default: float, text: str) -> None:
    """Declare the option of a quantity with its unit at the end of the name."""
    unit = name.rsplit("-", 1)[1].upper()
    add(f"--{name}", type=float, default=default, metavar=unit, help=f"{text} (default {default:g})")


def design_options(args: argparse.Namespace) -> DesignOptions:
    """Return the options of the design that the arguments describe.

    Raises:
        GeometryError: a value is out of range.
    """
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
    plan = ElectrodePlan(**{name: getattr(args, f"{name}_mm") * 1e-3 for name in _WIDTHS})
    full_scale = args.current_full_scale_ma
    return DesignOptions(
        stack=LayerStack(layers, args.assembly),
        plan=plan,
        wires=args.wires,
        electronics=GivenElectronics(
            supply_volts=args.supply_v,
            adc_volts=args.adc_v,
            adc_bits=args.adc_bits,
            pulldown_ohms=args.pulldown_ohm,
            current_full_scale=None if full_scale is None else full_scale * 1e-3,
        ),
        upper_sheet_ohms=args.upper_sheet_ohm,
        lower_sheet_ohms=args.lower_sheet_ohm,
        seam_gap=args.seam_gap_mm * 1e-3,
        overlap=args.overlap_mm * 1e-3,
        cover_seam=args.cover_seam,
        connector=args.connector_mm * 1e-3,
        sheet_gap=args.sheet_gap_mm * 1e-3,
        kerf=args.kerf_mm * 1e-3,
        snap=args.cut_tolerance_mm * 1e-3,
        face_up=args.face_up,
        jig=given_jig(args),
    )
