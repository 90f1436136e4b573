"""Options of the search: one value for all, names change some of it, and wrong ones are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.fit.cones import find_cones
from coneskin.geometry.fit.developable.packing import find_sheets
from coneskin.geometry.fit.fit_options import FitOptions

from ..synthetic import frustum, placed


@pytest.mark.long
def test_names_change_what_the_options_say() -> None:
    mesh = placed(frustum(0.05, 0.05, 0.2))
    asked = FitOptions(tolerance=0.0007, max_sheets=1, wrap=3.0)
    one, two, three = (
        find_cones(mesh, asked),
        find_cones(mesh, tolerance=0.0007, max_sheets=1, wrap=3.0),
        find_sheets(mesh, FitOptions(tolerance=0.002, max_sheets=1, wrap=3.0), tolerance=0.0007),
    )
    assert one.tolerance == two.tolerance == three.tolerance == 0.0007
    assert [sheet.placed for sheet in one.sheets] == [sheet.placed for sheet in two.sheets]
    assert one.sheets[0].frustum.wrap == pytest.approx(3.0, abs=0.1)
    assert [sheet.placed for sheet in one.sheets] == [sheet.placed for sheet in three.sheets]


@pytest.mark.parametrize(("sheets", "wires", "most"), [(3, None, 3), (3, 11, 2), (3, 40, 3), (1, 4, 1)])
def test_sheets_are_limited_by_their_wires_too(sheets: int, wires: int | None, most: int) -> None:
    assert FitOptions(max_sheets=sheets, max_wires=wires).most_sheets == most


def test_the_seam_is_a_unit_vector_of_any_direction_but_none() -> None:
    assert np.allclose(FitOptions(seam_direction=(0.0, -2.0, 0.0)).seam, [0.0, -1.0, 0.0])
    with pytest.raises(GeometryError, match="the direction of the seam must be three numbers, finite and not zero"):
        FitOptions(seam_direction=(0.0, 0.0, 0.0))


def test_too_loose_a_tolerance_and_an_unknown_name_are_refused() -> None:
    with pytest.raises(GeometryError, match="tolerance must be at most 20 mm, got 21 mm"):
        FitOptions(tolerance=0.021)
    with pytest.raises(GeometryError, match="did you mean max_sheets"):
        find_cones(placed(frustum(0.05, 0.05, 0.2)), max_sheet=2)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (1e308, 1e308, 0.0), (1e-320, 0.0, 0.0), (math.nan, 0.0, 0.0)])
def test_a_seam_that_faces_nowhere_is_refused(direction: tuple[float, ...]) -> None:
    with pytest.raises(GeometryError, match="the direction of the seam must be three numbers"):
        FitOptions(seam_direction=direction)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["max_sheets", "max_wires", "samples"])
@pytest.mark.parametrize("value", [math.nan, 150.5, "200", True, 0, -5, 10**12])
def test_counts_are_whole_numbers_in_their_range(name: str, value: object) -> None:
    with pytest.raises(GeometryError, match=f"{name} must be a whole number from"):
        FitOptions(**{name: value})  # type: ignore[arg-type]
