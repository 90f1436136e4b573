"""A link that is not round, from its mesh file to the place that a guard reports, judged by rays of another library."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

import coneskin as cs
from tests.support.ruled_tube import RuledTube, rounded_box_section

from .guarded_session import DEADLINE

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal"),
]
trimesh = pytest.importorskip("trimesh", reason="its rays are the judge (PyPI: trimesh)")

POSE = cs.Pose.from_xyz_rpy((0.01, 0.02, 0.05), (0.1, -0.2, 0.3))
#: a tapered box; an oval link: tests/design/test_bent_link.py
TUBE = RuledTube(rounded_box_section(0.1, 0.08, 0.025), 0.15, (0.0, 0.0, 0.9), POSE)
SCENE = """\
[[link]]
name = "shell"
mesh = "link.stl"
[[link.sensor]]
file = "skin/sensor.toml"
[source]
kind = "virtual"
rate_hz = 300
[monitoring]
skin_silence_ms = 900
"""


def first_hit(judge: trimesh.Trimesh, origin: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Where a ray meets the mesh first, of all its triangles: trimesh's own rays need a package for trees."""
    count = len(judge.faces)
    points, valid, ahead = trimesh.intersections.planes_lines(
        judge.triangles[:, 0], judge.face_normals, np.tile(origin, (count, 1)), np.tile(way, (count, 1)), True
    )[:3]
    inside = (trimesh.triangles.points_to_barycentric(judge.triangles[valid], points) >= -1e-9).all(axis=1)
    inside &= ahead > 0.0
    return points[inside][ahead[inside].argmin()]


def test_a_guard_reports_a_touch_where_it_is_on_the_mesh(tmp_path: Path) -> None:
    mesh = TUBE.mesh(around=160)
    judge = trimesh.Trimesh(1e3 * mesh.vertices, mesh.faces, process=False)  # mm, as files of links are
    judge.export(tmp_path / "link.stl")
    (sheet,) = cs.design_link(tmp_path / "link.stl", tmp_path / "skin", pictures=False).sheets
    assert sheet.place.kind == "general cone"
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    side = sheet.active
    with cs.guard(tmp_path / "scene.toml") as session:
        for u, part in ((0.03, 0.15), (0.06, 0.5), (0.1, 0.8)):
            before = len(session.events)
            phi = part * side.frustum.wrap
            session.touch(u, phi, 10.0, 1.5)
            found = session.wait_for(("contact_located",), DEADLINE, before)
            assert found is not None
            normal = np.array(side.normal(phi))
            above = 1e3 * (np.array(side.point(u, phi)) + 0.01 * normal)
            point = 1e3 * np.array(found.details["point"])
            hit = first_hit(judge, above, -normal)
            assert math.dist(point, hit) < 1.0, "mm; the decoder's own error of a contact of some millimetres"
            feet = trimesh.triangles.closest_point(judge.triangles, np.tile(point, (len(judge.faces), 1)))
            assert np.linalg.norm(feet - point, axis=1).min() < 0.05, "mm; it lies on the mesh"
            assert np.dot(found.details["normal"], normal) > math.cos(math.radians(2.0))
            assert session.wait_for(("touch_ended",), DEADLINE, before) is not None
