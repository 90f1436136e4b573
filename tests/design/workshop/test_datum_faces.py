"""Faces to measure from: flat, outermost and wide; the distances from them put a sheet back where it belongs."""

import math

import numpy as np
import pytest
import trimesh
from scipy.optimize import least_squares

from coneskin.design.workshop.placement import _datum_heights, _measured_faces, find_datum_faces, find_placement
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose

POSE = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, -0.5, 0.6))


def elbow(pose: Pose = POSE) -> Mesh:
    """A tube of radius 40 mm along z, from z = -0.1 to 0.1, on a block of 120 x 100 x 60 mm below it."""
    tube = trimesh.creation.cylinder(radius=0.04, height=0.2, sections=128)
    block = trimesh.creation.box((0.12, 0.1, 0.06))
    block.apply_translation((0.01, 0.0, -0.13))
    both = trimesh.util.concatenate([tube, block])
    return make_mesh(np.array(both.vertices), np.array(both.faces), "elbow").moved(pose)


def test_faces_are_outermost_flat_and_named_by_area() -> None:
    mesh = elbow()
    faces = find_datum_faces(mesh)
    assert [face.name for face in faces] == ["F1", "F2", "F3", "F4"]
    below = np.array(POSE.rotate((0.0, 0.0, -1.0)))
    assert faces[0].normal == pytest.approx(below), "120 x 100 mm under the block is the largest"
    assert faces[0].size == pytest.approx((0.12, 0.1))
    assert faces[0].offset == pytest.approx(float(np.array(POSE.apply((0.0, 0.0, -0.16))) @ below))
    for face in faces:
        assert np.linalg.norm(face.normal) == pytest.approx(1.0)
        assert float(face.height(mesh.vertices).min()) > -1e-6, "nothing of the link is beyond a face"
    inside = {tuple(np.round(POSE.inverse().rotate(face.normal), 6) + 0.0) for face in faces}
    # 120 x 60 mm at both sides of the block and the end of the tube, 80 mm wide; 100 x 60 mm would be the fifth
    assert inside == {(0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)}


def test_a_round_link_has_faces_at_its_ends_only() -> None:
    tube = trimesh.creation.cylinder(radius=0.04, height=0.2, sections=256)
    faces = find_datum_faces(make_mesh(np.array(tube.vertices), np.array(tube.faces), "tube"))
    assert sorted(face.normal[2] for face in faces) == pytest.approx([-1.0, 1.0])
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    assert find_datum_faces(make_mesh(np.array(ball.vertices), np.array(ball.faces), "ball")) == ()


class Counted(np.ndarray):
    """Corners that count the numbers which are computed with them."""

    numbers = 0

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        plain = [np.asarray(value) for value in inputs]
        Counted.numbers += max(value.size for value in plain)
        return getattr(ufunc, method)(*plain, **options)


@pytest.mark.long
def test_a_facet_of_a_fine_round_link_is_held_against_its_like_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.06)
    mesh = make_mesh(np.array(ball.vertices), np.array(ball.faces), "ball")
    monkeypatch.setitem(mesh.__dict__, "outermost", mesh.outermost.view(Counted))
    monkeypatch.setattr(Counted, "numbers", 0)
    assert find_datum_faces(mesh) == ()
    # held against all others, a hundred thousand facets took 97 s
    assert 0 < Counted.numbers / len(mesh.faces) < 100


def test_a_face_under_a_sheet_is_not_measured_from() -> None:
    faces = find_datum_faces(elbow(Pose()))
    for beyond, covered in ((0.01, False), (0.0, True)):  # nearly flat over the side at y = 50 mm, or 10 mm above it
        pose = Pose.from_xyz_rpy((0.0, beyond - 1.95, -0.25), (0.0, 0.0, 0.5 * math.pi - 0.1))
        kept = _measured_faces(PlacedFrustum(Frustum(2.0, 2.0, 0.2, 0.2), pose), faces)
        assert {face.normal[1] > 0.99 for face in kept} == ({False} if covered else {False, True})
        assert len(kept) == len(faces) - covered


@pytest.mark.parametrize("wrap", [2.0 * math.pi, 3.5])
def test_the_distances_alone_put_a_tilted_sheet_back(wrap: float) -> None:
    """Slid along its axis and turned, only the true place has the distances that the guide tells."""
    mesh = elbow(Pose())
    side = Frustum(0.03, 0.035, 0.06, wrap)
    placed = PlacedFrustum(side, Pose.from_xyz_rpy((0.01, 0.0, 0.02), (0.5, 0.9, 0.3)))
    place = find_placement(placed, mesh, find_datum_faces(mesh))
    assert place.tilted
    assert place.around_fixed
    told = np.array([row.heights for row in place.heights])

    def off(at: np.ndarray) -> np.ndarray:
        turn = Pose.from_xyz_rpy((0.0, 0.0, at[0]), (0.0, 0.0, at[1]))
        moved = PlacedFrustum(side, placed.link_frustum @ turn)
        points = [moved.place(row.u, row.phi)[0].reshape(3) for row in place.heights]
        return (np.stack([face.height(np.array(points)) for face in place.faces], axis=1) - told).ravel()

    for start in ((0.01, 0.3), (-0.015, -0.4)):
        found = least_squares(off, start, x_scale=(1e-2, 0.3), xtol=1e-14, ftol=1e-14, gtol=1e-14)
        assert found.x == pytest.approx((0.0, 0.0), abs=1e-7)
    # measured with a spread of 1 mm, as the guide asks, they hold it within 1 mm along and around
    jacobian = least_squares(off, (0.0, 0.0)).jac
    along, turn = 1e-3 * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert along < 1e-3
    assert turn * side.radius1 < 1e-3


def test_bold_distances_are_those_that_turning_changes() -> None:
    placed = PlacedFrustum(Frustum(0.04, 0.04, 0.1), Pose.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    faces = _measured_faces(placed, find_datum_faces(elbow(Pose())))
    for row in _datum_heights(placed, faces):
        turned = placed.place(row.u, row.phi + 1e-4)[0].reshape(3)
        for face, height, steep in zip(faces, row.heights, row.steep, strict=True):
            change = abs(float(face.height(turned)) - height) / (1e-4 * 0.04)
            assert steep == (change > 0.7), f"{face.name} at phi {row.phi:.3f} changes by {change:.2f}"


def test_an_axis_that_a_square_can_hold_is_measured_along() -> None:
    mesh = elbow(Pose())
    faces = find_datum_faces(mesh)
    assert not find_placement(PlacedFrustum(Frustum(0.04, 0.04, 0.1)), mesh, faces).tilted
    assert not find_placement(PlacedFrustum(Frustum(0.04, 0.04, 0.1)), mesh).heights
