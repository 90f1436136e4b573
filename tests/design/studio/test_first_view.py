"""First view: the sheet is in front, and nothing of the link stands before it."""

import math

import numpy as np
import pytest

from coneskin.design.link_design import LinkMesh
from coneskin.design.studio.design_text import electrode_marks
from coneskin.design.studio.first_view import _seen_shares, first_view
from coneskin.design.studio.workbench import Handles, Workbench
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from tests.geometry.synthetic import placed, revolve


@pytest.fixture(scope="module")
def bench() -> Workbench:
    link = LinkMesh("link", placed(revolve([(0.0, 0.05), (0.2, 0.05)], segments=48, rings=6), Pose()), "mesh", ())
    return Workbench.of(link)


def with_plate(mesh: Mesh, x: float) -> Mesh:
    """The link with a large plate across x."""
    corners = np.array([(x, y, z) for y in (-0.5, 0.5) for z in (-0.4, 0.6)])
    first = len(mesh.vertices)
    faces = np.concatenate([mesh.faces, first + np.array([(0, 1, 3), (0, 3, 2)])])
    return Mesh(np.concatenate([mesh.vertices, corners]), faces, mesh.source)


@pytest.mark.parametrize("seam", [0.0, 100.0, 200.0, 290.0])
@pytest.mark.long
def test_a_narrow_sheet_is_looked_at_from_in_front(bench: Workbench, seam: float) -> None:
    bench.handle(0, Handles(wrap=math.radians(60.0), seam=math.radians(seam)))
    (design,) = bench.designs
    mesh = bench.link.mesh
    eye, at = first_view(bench.designs, RayCaster(mesh), mesh.vertices)
    normal = np.array(design.place.normal(math.radians(30.0)))
    way = np.subtract(eye, at) / np.linalg.norm(np.subtract(eye, at))
    assert way @ normal > math.cos(math.radians(45.0))


@pytest.mark.long
def test_a_sheet_behind_a_plate_is_looked_at_from_the_side(bench: Workbench) -> None:
    bench.handle(0, Handles())
    mesh = with_plate(bench.link.mesh, 0.08)
    eye, _ = first_view(bench.designs, RayCaster(mesh), mesh.vertices)
    assert eye[0] < 0.08
    mesh = with_plate(bench.link.mesh, -0.08)
    eye, _ = first_view(bench.designs, RayCaster(mesh), mesh.vertices)
    assert eye[0] > -0.08


def test_from_far_off_a_cylinder_shows_what_faces_the_eye(bench: Workbench) -> None:
    """Of a full wrap the mean of the cosine where it is above c is sin(acos c) / pi; of the seam all, or nothing."""
    bench.handle(0, Handles())
    (design,) = bench.designs
    seam = np.array(design.place.normal(0.0))
    sheet, edge = _seen_shares(design, RayCaster(bench.link.mesh), np.array([seam, -seam]))
    assert sheet == pytest.approx(math.sin(math.acos(0.15)) / math.pi, abs=0.05)  # 14 places around
    assert edge[0] > 0.95
    assert edge[1] == 0.0


def test_letters_stand_before_their_electrodes(bench: Workbench) -> None:
    bench.handle(0, Handles())
    (design,) = bench.designs
    field = design.layout.field
    found = {mark.letter: mark for mark in electrode_marks(design)}
    assert sorted(found) == list("ABCD")
    for letter, mark in found.items():
        places = [design.place.locate(tuple(point)) for point in mark.letters.tolist()]
        assert all(off == pytest.approx(0.006, abs=1e-9) for _, _, off in places), "in front of the line"
        if letter in "AB":
            assert len(places) == 3, "one is in front from wherever a person looks"
            assert all((u > field.u2) if letter == "A" else (u < field.u1) for u, _, _ in places)
        else:
            ((u, phi, _),) = places
            assert field.u1 < u < field.u2
            assert (phi > field.phi2) if letter == "C" else (phi < field.phi1)
