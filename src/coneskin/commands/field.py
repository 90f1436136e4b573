"""Command ``coneskin field``: the electric field of a sensor, as pictures, and how far a large contact is misread.

example:
  coneskin field --radius1-mm 40 --radius2-mm 70 --height-mm 150 --wrap-deg 300 -o field
  Draw the potential of both sheets while a contact presses on the middle, and two error maps: decoded minus true place
  of a contact, all over the sensor. Print the resistances of the sheets and the largest errors.

A contact is a round perfect bond. Its place is decoded from the mean of the two guides, as in the paper (eq. 20, 24):
the live decode takes the area's influence off. The paper's own figures and tables: python demos/paper/paper_figures.py
Exit code: 0; 1 there is no such sensor, a file cannot be written, or a package is not installed; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import FieldError
from coneskin.core.files import explain_os_error

from .dimensions import add_cone_options, given_cone

if TYPE_CHECKING:
    from coneskin.skin.field.maps import ErrorMap
    from coneskin.skin.field.model import FieldModel

_ADC_OHMS = 1e9  # an input of the converter, which fixes a guide
_PICTURES = ("potential_radial", "potential_angular", "error_u", "error_phi")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = "Solve the field of your sensor exactly: potential maps, error maps, resistances."
    add = parser.add_argument
    add_cone_options(add)
    add("--upper-ohm", type=float, default=1000.0, help="upper sheet resistance [ohm per square] (default: 1000)")
    add("--lower-ohm", type=float, help="lower sheet resistance [ohm per square] (default: that of the upper one)")
    add("--contact-mm", type=float, default=5.0, help="radius of the contact (default: 5)")
    add("--supply-v", type=float, default=2.5, help="potential of the driven electrode (default: 2.5)")
    add("--grid", type=int, default=41, help="points along each side of an error map (default: 41)")
    add("-o", "--output", type=Path, default=Path("field"), metavar="DIR", help="folder for the pictures (field)")
    add("--no-pictures", action="store_true", help="print the numbers, write no file")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Run the command and return 0.

    Raises:
        GeometryError: there is no such cone.
        FieldError: a value is out of range, or the folder cannot be made.
        MissingExtra: matplotlib is not installed.
    """
    import numpy as np

    from coneskin.skin.field.maps import ErrorMap
    from coneskin.skin.field.model import FieldModel
    from coneskin.skin.field.sheet import SectorSheet
    from coneskin.skin.sensor import sheet_resistances

    if args.grid < 2:
        raise FieldError(f"--grid must be at least 2 points, got {args.grid}")
    cone = given_cone(args)
    lower_ohm = args.upper_ohm if args.lower_ohm is None else args.lower_ohm
    radial_ohm, angular_ohm = sheet_resistances(cone, args.upper_ohm, lower_ohm)
    model = FieldModel(SectorSheet.of_frustum(cone), args.upper_ohm, lower_ohm)
    sheet, radius = model.sheet, args.contact_mm * 1e-3
    margin = 1.001 * radius  # the contact's rim stays just inside
    turn = margin / (min(cone.radius1, cone.radius2) * cone.wrap)
    if not (radius > 0.0 and 2.0 * margin < sheet.width and 2.0 * turn < 1.0):
        raise FieldError(f"--contact-mm must be above 0 mm and fit on the sensor, got {args.contact_mm!r} mm")
    u = np.linspace(margin, sheet.width - margin, args.grid)
    errors = ErrorMap.of(model, radius, u, np.linspace(turn, 1.0 - turn, args.grid) * sheet.wrap)
    pictures = [] if args.no_pictures else _draw(model, errors, radius, args.supply_v, args.output)
    facts = {
        "radial_ohm": radial_ohm,
        "angular_ohm": angular_ohm,
        "largest_u_error_mm": float(np.nanmax(np.abs(errors.u_error))) * 1e3,
        "largest_phi_error_deg": math.degrees(float(np.nanmax(np.abs(errors.phi_error)))),
    }
    if args.json:
        print(json.dumps({**facts, "pictures": [str(path) for path in pictures]}))
        return 0
    print(f"resistance A to B  {radial_ohm:10.1f} ohm")
    print(f"resistance C to D  {angular_ohm:10.1f} ohm")
    print(f"largest error, contact of {args.contact_mm:g} mm: u {facts['largest_u_error_mm']:.3f} mm, ", end="")
    print(f"phi {facts['largest_phi_error_deg']:.3f} deg", *(f"wrote {path}" for path in pictures), sep="\n")
    return 0


def _draw(model: FieldModel, errors: ErrorMap, radius: float, supply: float, folder: Path) -> list[Path]:
    """Draw all pictures, and return where they are."""
    import numpy as np

    from coneskin.skin.field.disc import Disc
    from coneskin.skin.field.fourport import angular_phase, radial_phase
    from coneskin.skin.field.maps import FieldMap
    from coneskin.skin.field.pictures import draw_potential, paint_error

    with explain_os_error(FieldError, f"cannot make the folder {folder}", "; name another with -o"):
        folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.png" for name in _PICTURES]
    sheet, live = model.sheet, f"{supply:g} V"
    contact = [Disc(0.5 * sheet.width, 0.5 * sheet.wrap, radius)]
    radial = FieldMap.of(model, contact, radial_phase(supply, _ADC_OHMS))
    draw_potential(paths[0], radial, True, f"upper sheet, B at {live}, A at 0 V", {"A": "A", "B": "B"})
    angular = FieldMap.of(model, contact, angular_phase(supply, _ADC_OHMS))
    draw_potential(paths[1], angular, False, f"lower sheet, C at {live}, D at 0 V", {"C": "C", "D": "D"})
    for path, error, name in (
        (paths[2], errors.u_error * 1e3, "u [mm]"),
        (paths[3], np.degrees(errors.phi_error), "phi [deg]"),
    ):
        figure, axes, _ = paint_error(sheet, errors.u, errors.phi, error, f"decoded minus true {name}")
        axes.set_title(f"error of {name}, contact radius {radius * 1e3:g} mm", fontsize=10)
        figure.savefig(path, dpi=130)
    return paths
