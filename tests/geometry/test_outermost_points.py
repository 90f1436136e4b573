"""Outermost points of a body: they reach as far as all do, whatever the direction."""

import numpy as np
import trimesh

from coneskin.geometry.mesh import _outermost_points, make_mesh


def test_they_reach_as_far_as_all_and_none_is_inside() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(4000, 3)) * [0.05, 0.02, 0.1]
    few = _outermost_points(points)
    assert 4 <= len(few) < 200
    for way in rng.normal(size=(50, 3)):
        np.testing.assert_allclose((few @ way).max(), (points @ way).max(), rtol=1e-12)
        across = points - np.outer(points @ way, way) / (way @ way)  # the farthest from any axis is one of them, too
        mine = few - np.outer(few @ way, way) / (way @ way)
        np.testing.assert_allclose((mine**2).sum(axis=1).max(), (across**2).sum(axis=1).max(), rtol=1e-12)


def test_all_points_of_a_plane_are_returned() -> None:
    flat = np.random.default_rng(4).random((30, 3)) * [1.0, 1.0, 0.0]
    assert _outermost_points(flat) is flat


def test_a_mesh_keeps_them_where_nobody_can_change_them() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    mesh = make_mesh(np.array(ball.vertices), np.array(ball.faces))
    assert mesh.outermost is mesh.outermost
    assert not mesh.outermost.flags.writeable
