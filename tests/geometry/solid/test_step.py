"""STEP: the solids have the cones, the planes and the corners that the layers have; read without a CAD kernel."""

import math
import re
import sys
from pathlib import Path

import pytest

from coneskin.core.errors import MissingExtra
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.solid import WrappedLayer, require_step_writer, write_step

CONE = Frustum(0.05, 0.07, 0.15, math.radians(300))


def corners(text: str) -> list[tuple[float, ...]]:
    """Places of the vertices of a STEP file [mm]."""
    points = dict(re.findall(r"#(\d+) = CARTESIAN_POINT\('',\(([^)]*)\)\);", text))
    places = re.findall(r"VERTEX_POINT\('',#(\d+)\)", text)
    return [tuple(float(value) for value in points[place].split(",")) for place in places]


def test_corners_and_cones_are_those_of_the_layer(tmp_path: Path) -> None:
    pytest.importorskip("OCP", reason="the extra cad is not installed")
    path = tmp_path / "layer.step"
    write_step(path, [WrappedLayer("isolation", CONE, 2.5e-3, Pose())])
    text = path.read_text().replace("\n", "")
    assert "'isolation'" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    found = corners(text)
    side, t = CONE, 2.5e-3
    wanted = {
        (1e3 * (radius + off * side.cos_half_angle), 1e3 * (z - off * side.sin_half_angle), phi)
        for off in (0.0, t)
        for radius, z in ((0.05, 0.0), (0.07, 0.15))
        for phi in (0.0, math.radians(300))
    }
    assert len(found) == 8
    for radius, z, phi in wanted:
        want = (radius * math.cos(phi), radius * math.sin(phi), z)
        assert min(math.dist(want, corner) for corner in found) < 1e-9, "within a picometre, in millimetres"
    cones = [tuple(map(float, pair)) for pair in re.findall(r"CONICAL_SURFACE\('',#\d+,([^,]*),([^)]*)\)", text)]
    assert sum(abs(angle - side.half_angle) < 1e-9 for _, angle in cones) == 2, "both faces"


def test_nothing_is_written_to_the_screen(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("OCP", reason="the extra cad is not installed")
    write_step(tmp_path / "a.step", [WrappedLayer("a", Frustum(0.054, 0.054, 0.2), 1e-4, Pose())])
    assert capfd.readouterr() == ("", "")


def test_without_the_kernel_the_pip_line_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OCP.BRepBuilderAPI", None)
    monkeypatch.setitem(sys.modules, "OCP", None)
    with pytest.raises(MissingExtra, match=r"pip install 'coneskin\[cad\]'"):
        write_step(tmp_path / "a.step", [WrappedLayer("a", CONE, 1e-4, Pose())])
    with pytest.raises(MissingExtra, match=r"pip install 'coneskin\[cad\]'"):
        require_step_writer()
