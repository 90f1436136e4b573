"""Section 3 and Table 2 of the paper from the exact field: numbers and error maps.

The paper gives neither the radii nor the angle of its sector, nor the sheets' resistances, nor how the contact
conducts. Here r1 = 100 mm, r2 = 200 mm, theta0 = 90 deg are inferred from its figures, the sheets are equal ("the
electrical conductivity of the lower conductive layer was the same"), a contact is a perfect bond, and a phase is
decoded from the mean of its two guides. Its grids of contact places are unpublished too, and the largest error
depends on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.skin.field import maps
from coneskin.skin.field.maps import ErrorMap
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet

_UNEXPLAINED = "not reproduced: see the residuals"
_GRID = "depends on the paper's grid of places, which is not published"

#: Figures 11 and 12, a and b: radius of the contacts [mm], the largest errors in the paper [mm] and [deg], and two
#: areas that its grid may have had, by their distance from the edges [mm] and [deg].
FIGURES = (
    ("a", 1.0, 0.06, 0.018, ((10.0, 5.0), (2.0, 2.0))),
    ("b", 15.0, 3.5, 1.9, ((20.0, 15.0), (15.0, 10.0))),
)

#: Radius of the contacts of Table 2 [mm].
TABLE_2_RADIUS_MM = 9.5

#: Paper, Table 2: (r [mm], theta [deg]) applied, error (mm, deg).
TABLE_2 = (
    (140.0, 35.0, -2.5, -1.137),
    (140.0, 55.0, -2.3, -0.937),
    (160.0, 35.0, -1.9, -0.985),
    (160.0, 55.0, -2.1, -1.09),
)


@dataclass(frozen=True, slots=True)
class TableRow:
    """One number of the paper beside ours.

    Attributes:
        what: what it is.
        paper: the paper's number.
        ours: ours.
        unit: of both.
        verdict: "reproduced", "depends on the grid" or "not reproduced", with the reason.
    """

    what: str
    paper: float
    ours: float
    unit: str
    verdict: str

    @property
    def residual(self) -> float:
        """The paper's number minus ours; NaN where it gives none."""
        return self.paper - self.ours


def paper_model(r1_mm: float = 100.0, r2_mm: float = 200.0, theta0_deg: float = 90.0, ratio: float = 1.0) -> FieldModel:
    """Return the paper's sector, as inferred; ratio is the lower over the upper sheet resistance."""
    sheet = SectorSheet.of_sector(r1_mm * 1e-3, (r2_mm - r1_mm) * 1e-3, math.radians(theta0_deg))
    return FieldModel(sheet, 1.0, ratio)


def decode_errors(
    model: FieldModel, r: Floats, theta: Floats, radius: float, conductance: float = math.inf
) -> tuple[Floats, Floats]:
    """Decoded minus true (r [m], theta [rad])."""
    return maps.decode_errors(model, *model.sheet.from_polar(r, theta), radius, conductance)


def error_map(
    model: FieldModel, radius_mm: float, r_mm: Floats, theta_deg: Floats, conductance: float = math.inf
) -> ErrorMap:
    """The errors over a grid of discs; conductance per area [S/m^2]. Its u is r - r1, its phi is theta."""
    u, phi = model.sheet.from_polar(r_mm * 1e-3, 0.0)[0], np.radians(theta_deg)
    return ErrorMap.of(model, radius_mm * 1e-3, u, phi, conductance)


def influence_of_area(model: FieldModel, radii_mm: Floats, r_mm: float, theta_deg: float) -> tuple[Floats, Floats]:
    """Compute figures 11c and 12c: errors [mm], [deg] at one place over the radius of the contact."""
    r, theta = np.array([r_mm * 1e-3]), np.array([math.radians(theta_deg)])
    errors = [decode_errors(model, r, theta, float(a) * 1e-3) for a in radii_mm]
    return np.array([float(e[0][0]) * 1e3 for e in errors]), np.array([math.degrees(float(e[1][0])) for e in errors])


def largest_errors(
    model: FieldModel,
    radius_mm: float,
    margin_mm: float,
    margin_deg: float,
    conductance: float = math.inf,
    edges: tuple[float, float, float] = (100.0, 200.0, 90.0),
    side: int = 41,
) -> tuple[float, float, float]:
    """Return the largest errors of r [mm], theta [deg] this far from the edges, and the part of r errors below 0.

    Args:
        model: the sensor.
        radius_mm: of the contacts [mm].
        margin_mm: distance of the contacts from the arcs [mm].
        margin_deg: distance of the contacts from the straight edges [deg].
        conductance: of the contacts per area [S/m^2].
        edges: r1 [mm], r2 [mm] and theta0 [deg] of the model.
        side: contacts along each side of the grid.
    """
    grid = error_map(
        model,
        radius_mm,
        np.linspace(edges[0] + margin_mm, edges[1] - margin_mm, side),
        np.linspace(margin_deg, edges[2] - margin_deg, side),
        conductance,
    )
    smaller = float((grid.u_error < 0.0).mean())
    largest = [float(np.nanmax(np.abs(error))) for error in (grid.u_error, grid.phi_error)]
    return largest[0] * 1e3, math.degrees(largest[1]), smaller


def rows(model: FieldModel) -> list[TableRow]:
    """Return the paper's numbers beside ours, for its inferred geometry (r from 100 to 200 mm, 90 deg)."""
    out = []
    for letter, radius, paper_r, paper_t, areas in FIGURES:
        for margin_mm, margin_deg in areas:
            r_error, t_error, smaller = largest_errors(model, radius, margin_mm, margin_deg)
            at = f"radius {radius:g} mm, {margin_mm:g} mm and {margin_deg:g} deg from the edges"
            out.append(TableRow(f"fig. 11{letter}: largest r error, {at}", paper_r, r_error, "mm", _GRID))
            out.append(TableRow(f"fig. 12{letter}: largest theta error, {at}", paper_t, t_error, "deg", _GRID))
    centre_r, centre_t = influence_of_area(model, np.array([15.0]), 150.0, 45.0)
    out += [
        TableRow(
            "fig. 11b: part of the r errors below zero", math.nan, smaller, "", 'reproduced: the paper says "most"'
        ),
        TableRow(
            "fig. 11c: r error at (150 mm, 45 deg), radius 15 mm", math.nan, float(centre_r[0]), "mm", "is -a^2/(2r)"
        ),
        TableRow(
            "fig. 12c: theta error at (150 mm, 45 deg), any radius",
            0.0014,
            abs(float(centre_t[0])),
            "deg",
            "zero by symmetry; the paper's value is within the noise of a mesh",
        ),
    ]
    for r, theta, dr, dtheta in TABLE_2:
        ours_r, ours_t = decode_errors(
            model, np.array([r * 1e-3]), np.array([math.radians(theta)]), TABLE_2_RADIUS_MM * 1e-3
        )
        at = f"table 2 at ({r:g} mm, {theta:g} deg), radius {TABLE_2_RADIUS_MM:g} mm"
        out.append(
            TableRow(
                f"{at}: r error",
                dr,
                float(ours_r[0]) * 1e3,
                "mm",
                _UNEXPLAINED,
            )
        )
        out.append(TableRow(f"{at}: theta error", dtheta, math.degrees(float(ours_t[0])), "deg", _UNEXPLAINED))
    return out
