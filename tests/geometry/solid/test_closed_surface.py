"""Closed surface: the shell between two grids encloses what it should, and its STL file says so."""

import io
import math

import numpy as np
import pytest
import trimesh

from coneskin.core.errors import GeometryError
from coneskin.geometry.solid import shell_surface, to_stl


def shell(
    inner: float, outer: float, height: float = 0.1, turn: float = 3.0, columns: int = 181
) -> tuple[np.ndarray, np.ndarray]:
    phi, z = np.meshgrid(np.linspace(0.0, turn, columns), [0.0, 0.5 * height, height])
    return tuple(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1) for r in (inner, outer))  # type: ignore[return-value]


def test_a_part_of_a_tube_has_the_volume_of_its_polygon() -> None:
    surface = shell_surface(*shell(0.05, 0.06))
    step = 3.0 / 180
    area = 0.5 * 180 * math.sin(step) * (0.06**2 - 0.05**2)
    assert surface.volume == pytest.approx(0.1 * area, rel=1e-12)
    inside_out = shell_surface(*reversed(shell(0.05, 0.06)))
    assert inside_out.volume == pytest.approx(surface.volume), "its faces are turned outwards"


def test_rows_that_coincide_leave_no_hole() -> None:
    inner, outer = (np.repeat(grid, 2, axis=0) for grid in shell(0.05, 0.06))
    solid = trimesh.load(io.BytesIO(to_stl(shell_surface(inner, outer))), file_type="stl")
    assert solid.is_watertight
    assert solid.volume == pytest.approx(1e9 * shell_surface(*shell(0.05, 0.06)).volume, rel=1e-5)


def test_a_file_is_of_the_length_that_the_format_says() -> None:
    surface = shell_surface(*shell(0.05, 0.06))
    data = to_stl(surface, "forearm é")
    assert len(data) == 84 + 50 * len(surface.faces)
    assert int.from_bytes(data[80:84], "little") == len(surface.faces)
    assert not data.startswith(b"solid")


def test_grids_that_differ_or_enclose_nothing_are_refused() -> None:
    inner, outer = shell(0.05, 0.06)
    with pytest.raises(GeometryError, match="two grids of at least 2 x 2 points are needed"):
        shell_surface(inner[:1], outer[:1])
    with pytest.raises(GeometryError, match="enclose nothing"):
        shell_surface(inner, inner)
