"""One call from a mesh, or from dimensions, to the sheets and to the folder for the workshop."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

import coneskin as cs
from coneskin.core.errors import GeometryError
from coneskin.design import link_design
from coneskin.design.link_design import NothingFits, design_link, load_link
from coneskin.geometry.mesh import Mesh, make_mesh


def tube() -> Mesh:
    phi = np.linspace(0, 2 * np.pi, 97)[:-1]
    ring = np.stack([0.05 * np.cos(phi), 0.05 * np.sin(phi)], axis=1)
    corners = np.concatenate([np.column_stack([ring, np.full(96, z)]) for z in (0.0, 0.2)])
    faces = [f for i in range(96) for f in ((i, (i + 1) % 96, 96 + i), ((i + 1) % 96, 96 + (i + 1) % 96, 96 + i))]
    return Mesh(corners, np.array(faces), "tube.stl")


def test_dimensions_are_designed_and_written_in_one_call(tmp_path: Path) -> None:
    steps: list[str] = []
    design = cs.design_link(cs.Frustum(0.04, 0.07, 0.15), tmp_path / "skin", pictures=False, progress=steps.append)
    assert [sheet.name for sheet in design.sheets] == ["sheet 1"]
    assert design.folder == tmp_path / "skin"
    assert (tmp_path / "skin" / "report.md").is_file()
    assert {path.relative_to(tmp_path / "skin").as_posix() for path in (tmp_path / "skin").rglob("*.*")} == set(
        design.data["files"]
    )
    assert {bed["file"] for bed in design.data["beds"]} == {
        f"nested/{path.name[:-4]}" for path in (tmp_path / "skin" / "nested").glob("*.dxf")
    }
    assert steps
    with pytest.raises(cs.GeometryError, match=r"exists already.*replace=True"):
        cs.design_link(cs.Frustum(0.04, 0.07, 0.15), tmp_path / "skin")
    again = cs.design_link(cs.Frustum(0.04, 0.07, 0.16), tmp_path / "skin", pictures=False, replace=True)
    assert "160.000" in (tmp_path / "skin" / "report.md").read_text()
    assert again.folder == tmp_path / "skin"


@pytest.mark.long
def test_a_mesh_is_designed_without_a_folder() -> None:
    design = cs.design_link(tube(), max_sheets=1)
    (sheet,) = design.sheets
    assert sheet.place.frustum.radius1 == pytest.approx(0.05, abs=1e-4)
    assert design.fit is not None
    assert design.name == "tube"
    assert sheet.options.link == "tube"
    assert design.folder is None
    points, normals = sheet.place.place([0.0, 0.05], [0.0, 1.0])
    assert points.shape == normals.shape == (2, 3)


@pytest.mark.parametrize(
    ("name", "visual"),
    [
        ("visual/link.stl", True),
        ("visual_meshes/forearm/link.stl", True),
        ("collision_free/visual/link.stl", True),
        ("visual/link_hull.stl", False),
        ("visual/hulls/link.stl", False),
        ("visual/Link-Convex.stl", False),
        ("VisualStudio/link.stl", False),
    ],
)
def test_the_nearest_name_in_a_path_says_whether_a_mesh_is_the_visual_one(
    tmp_path: Path, name: str, visual: bool
) -> None:
    path = tmp_path / name
    path.parent.mkdir(parents=True)
    trimesh.creation.box((0.1, 0.1, 0.2)).export(path)
    assert [link.visual for link in load_link(str(path), "m")] == [visual]


def test_a_name_without_a_folder_and_the_nearest_of_two_folders_count() -> None:
    names = ("maker__meshes_VISUAL_link.stl", "meshes/collision/link.stl", "visual/collision/link.stl")
    assert [link_design._called_visual(name) for name in names] == [True, False, False]


@pytest.mark.long
@pytest.mark.parametrize(("source", "taken"), [("meshes/visual/link.stl", True), ("link.stl", False)])
def test_a_convex_mesh_is_taken_for_the_link_where_it_is_called_visual(source: str, taken: bool) -> None:
    """A stadium 0.6 m wide; its half tubes are 11 % of it, too little for a mesh that may be a collision hull."""
    phi = np.linspace(0.0, np.pi, 25)
    arc = np.stack([0.3 + 0.03 * np.sin(phi), 0.03 * np.cos(phi)], axis=1)
    rings = [np.column_stack([np.concatenate([arc, -arc]), np.full(50, z)]) for z in (0.0, 0.2)]
    hull = ConvexHull(np.concatenate(rings))
    body = make_mesh(hull.points, hull.simplices, source)
    if not taken:
        with pytest.raises(
            cs.GeometryError, match=r"use the visual mesh of the link, or allow_hull \(--set search.allow_hull=true\)"
        ):
            cs.design_link(body)
        return
    design = cs.design_link(body)
    assert [sheet.place.frustum.radius1 for sheet in design.sheets] == pytest.approx([0.03, 0.03], abs=1e-3)
    assert any("it is called visual, and taken for the link" in note for note in design.notes)
    allowed = design_link(body, allow_hull=True, round_only=True)
    assert not any("it is called visual" in note for note in allowed.notes)


def test_what_cannot_be_covered_says_why() -> None:
    with pytest.raises(cs.GeometryError, match="there is no sheet to design: "):
        cs.design_link(tube(), min_length=0.3)


@pytest.mark.long
def test_drawings_name_their_extents(tmp_path: Path) -> None:
    """Some cutters compare them with their bed, and a viewer shows them first."""
    ezdxf = pytest.importorskip("ezdxf")
    cs.design_link(cs.Frustum(0.04, 0.07, 0.15), tmp_path / "skin", pictures=False)
    from ezdxf import bbox

    for path in [tmp_path / "skin" / "cut" / "3-lower-conductive.dxf", *(tmp_path / "skin" / "nested").glob("*.dxf")]:
        document = ezdxf.readfile(path)
        lines = [item for item in document.modelspace() if item.dxftype() == "LWPOLYLINE"]
        box = bbox.extents(lines, fast=False)
        assert tuple(document.header["$EXTMIN"])[:2] == pytest.approx(tuple(box.extmin)[:2], abs=0.02)
        assert tuple(document.header["$EXTMAX"])[:2] == pytest.approx(tuple(box.extmax)[:2], abs=0.02)


def test_a_mesh_on_which_nothing_fits_is_refused_with_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    source = SimpleNamespace(mesh=SimpleNamespace(source="box.stl"))
    fit = SimpleNamespace(sheets=(), reason="it is a box")
    monkeypatch.setattr(link_design, "_fit_link", lambda *_, **__: (source, fit))
    with pytest.raises(NothingFits, match="there is no sheet to design: it is a box") as caught:
        design_link("box.stl")
    assert (caught.value.source, caught.value.fit) == ("box.stl", fit)


@pytest.mark.parametrize(
    ("link", "named", "said"),
    [
        (None, {}, "the link must be a mesh file, a Mesh, a Frustum or places, got None"),
        (cs.Frustum(0.05, 0.05, 0.2), {"wrap": 3.0}, "wrap is an option of the search in a mesh, and this link has"),
        (cs.Frustum(0.05, 0.05, 0.2), {"foo": 1}, "foo is no option of the search for sheets; known: allow_hull, "),
        (cs.Frustum(0.05, 0.05, 0.2), {"max_sheet": 1}, "did you mean max_sheets?"),
        (cs.Frustum(54, 70, 150), {}, "radius1 must be at most 5 m, got 54 m: lengths are in meters, 54 mm is 0.054"),
        ([cs.PlacedFrustum(cs.Frustum(0.05, 0.05, 200))], {}, "height must be at most 5 m, got 200 m"),
        ([cs.Frustum(0.05, 0.05, 0.2)], {}, "a place must be a PlacedFrustum, got Frustum("),
    ],
)
def test_what_no_link_can_be_is_refused(link: object, named: dict[str, object], said: str) -> None:
    with pytest.raises(GeometryError) as raised:
        cs.design_link(link, **named)  # type: ignore[arg-type]
    assert said in str(raised.value)


@pytest.mark.parametrize("places", ["link.stl", [cs.Frustum(0.05, 0.05, 0.2)]])
def test_places_that_are_none_are_refused(places: Any) -> None:
    with pytest.raises(GeometryError, match="a place must be a PlacedFrustum, got "):
        cs.design_sheets(places)
