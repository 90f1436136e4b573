"""Samples: spread by area, only where the outside is seen, with normals that look out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import MeshError
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import Floats, Indices, flipped, frustum, joined, moved, noisy, rugby

TUBE = frustum(0.05, 0.05, 0.3)


def outward(points: Floats, normals: Floats) -> Floats:
    """Cosine between the normal and the way out of a body about z through the middle."""
    out = points - [0.0, 0.0, 0.15]
    return np.asarray(np.einsum("ij,ij->i", out, normals))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_normals_look_out_however_the_faces_are_wound(share: float) -> None:
    mesh = make_mesh(*flipped(rugby(), share))
    samples = sample_surface(mesh, RayCaster(mesh))
    assert len(samples) > 5900
    assert (outward(samples.points, samples.normals) > 0.0).all()


def test_samples_are_spread_by_area() -> None:
    mesh = make_mesh(*TUBE)
    samples = sample_surface(mesh, RayCaster(mesh), 6000)
    side = np.abs(samples.normals[:, 2]) < 0.5
    true = 0.3 / (0.3 + 0.05)  # of 2 pi r h + 2 pi r^2
    # 6000 crossings of lines that are spread evenly
    assert side.mean() == pytest.approx(true, abs=0.002)
    assert samples.area * len(samples) == pytest.approx(2.0 * math.pi * 0.05 * 0.35, rel=1e-3)
    counts = np.histogram(samples.points[side, 2], 10, (0.0, 0.3))[0]
    assert counts.min() > 0.8 * counts.max()


def test_inner_walls_are_left_out() -> None:
    mesh = make_mesh(*joined(TUBE, (frustum(0.045, 0.045, 0.28)[0] + [0.0, 0.0, 0.01], TUBE[1])))
    samples = sample_surface(mesh, RayCaster(mesh))
    assert (np.hypot(samples.points[:, 0], samples.points[:, 1])[np.abs(samples.normals[:, 2]) < 0.5] > 0.049).all()
    assert 0.5 < len(samples) / 6000 < 0.6


def test_samples_lie_on_their_faces() -> None:
    mesh = make_mesh(*noisy(rugby(), 1e-3))
    samples = sample_surface(mesh, RayCaster(mesh))
    corner = mesh.vertices[mesh.faces[samples.faces, 0]]
    off = np.einsum("ij,ij->i", samples.points - corner, samples.normals)
    np.testing.assert_allclose(off, 0.0, atol=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_an_open_sheet_looks_away_from_the_middle(share: float) -> None:
    corners, faces = flipped(TUBE, share)
    quarter = faces[np.arctan2(*corners[faces].mean(axis=1)[:, 1::-1].T) > 2.3]
    mesh = make_mesh(corners, quarter)
    samples = sample_surface(mesh, RayCaster(mesh))
    side = np.abs(samples.normals[:, 2]) < 0.5
    assert (np.einsum("ij,ij->i", samples.points, samples.normals)[side] > 0.0).all()


def test_the_same_surface_gives_the_same_samples() -> None:
    """In the frame of the body, whatever its pose, its side, the order of its faces and their number."""
    wedge = joined(rugby(), moved(TUBE, Pose.from_xyz_rpy((0.03, 0.01, 0.1), (0.3, 1.2, 0.1))))
    corners, faces = wedge
    middles = corners[faces].mean(axis=1)
    inner = len(corners) + np.arange(len(faces))
    finer = np.concatenate([np.stack([faces[:, k], faces[:, k - 2], inner], axis=1) for k in range(3)])
    copies = [
        (corners, faces[::-1]),
        moved(wedge, Pose.from_xyz_rpy((0.3, -0.2, 0.1), (0.4, -0.7, 1.1))),
        (corners * [1.0, -1.0, 1.0], faces[:, ::-1]),
        (np.concatenate([corners, middles]), finer),
    ]

    def seen(body: tuple[Floats, Indices]) -> Floats:
        mesh = make_mesh(*body)
        middle, ways = mesh.own_frame
        return np.asarray((sample_surface(mesh, RayCaster(mesh), 500).points - middle) @ ways)

    for copy in copies:
        np.testing.assert_allclose(seen(copy), seen(wedge), atol=1e-7)


def test_a_mesh_that_nothing_sees_is_refused() -> None:
    class Walled(RayCaster):
        def cast(self, origins: Floats, directions: Floats) -> tuple[Floats, Indices]:
            return np.zeros(len(origins)), np.zeros(len(directions), np.int64)

    mesh: Mesh = make_mesh(*TUBE)
    with pytest.raises(MeshError, match="no face is visible from outside"):
        sample_surface(mesh, Walled(mesh))
