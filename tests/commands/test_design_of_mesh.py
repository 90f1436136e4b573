"""``coneskin design`` of a mesh: from its file to a sensor in its frame, or the reason why there is none."""

import json
import math
import struct
import tomllib

import pytest

from coneskin.cli import main
from tests.geometry.synthetic import frustum
from tests.geometry.test_mesh import write_stl

from .design_run import design, sensor_of


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--seam", "0", "0", "0"], "--seam takes a direction X Y Z, finite and not 0 0 0, got 0.0 0.0 0.0"),
        (["--set", "search.touch_side=[0, 0, 0]"], "search.touch_side must be a direction X, Y, Z that is not 0, 0, 0"),
        (["--seam", "nan", "0", "0"], "--seam takes a direction X Y Z, finite and not 0 0 0, got nan 0.0 0.0"),
        (
            ["--set", "search.max_bridge_mm=1e6"],
            "--set search.max_bridge_mm must be above 0 to 100 mm, got 1000000.0 mm",
        ),
        (["--tolerance-mm", "1e9"], "--tolerance-mm must be above 0 to 20 mm, got 1000000000.0 mm"),
        (["--tolerance-mm", "nan"], "--tolerance-mm must be above 0 to 20 mm, got nan mm"),
    ],
)
def test_a_mistake_about_a_mesh_is_one_clear_line(words, line, tmp_path, capsys):
    folder = tmp_path / "out"
    mesh = write_stl(tmp_path / "tube.stl", frustum(0.05, 0.05, 0.2, 24, 1))
    assert design(str(mesh), *words, "-o", str(folder)) == 1
    errors = [row for row in capsys.readouterr().err.splitlines() if row.startswith("coneskin design:")]
    assert len(errors) == 1
    assert line in errors[0]
    assert not folder.exists()


def stl(path, triangles):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for p in t for x in p), 0) for t in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + body)


def tube(radius1, radius2, height, sides=96):
    """Open tube about the y axis, off the origin, in metres."""
    ring = [(math.cos(2 * math.pi * i / sides), math.sin(2 * math.pi * i / sides)) for i in range(sides + 1)]
    low = [(0.3 + radius1 * c, -0.1, 0.05 - radius1 * s) for c, s in ring]
    high = [(0.3 + radius2 * c, -0.1 + height, 0.05 - radius2 * s) for c, s in ring]
    for i in range(sides):
        yield low[i], low[i + 1], high[i + 1]
        yield low[i], high[i + 1], high[i]


@pytest.mark.long
def test_a_mesh_from_file_to_sensor_in_the_meshs_frame(tmp_path, capsys):
    stl(tmp_path / "cone.stl", list(tube(0.040, 0.050, 0.160)))
    assert design(str(tmp_path / "cone.stl"), "-o", str(tmp_path / "out")) == 0
    assert "note: unit m guessed from the largest extent, 0.16" in capsys.readouterr().err
    _, placed = sensor_of(tmp_path / "out")
    table = tomllib.loads((tmp_path / "out" / "sensor.toml").read_text())
    assert all(value == round(value, 4) for value in (*table["xyz_mm"], *table["rpy_deg"]))  # a fit has more digits
    for u in (0.0, placed.frustum.slant):
        for phi in (0.0, 1.0, 4.0):
            x, y, z = placed.point(u, phi)
            # on the upper conductive layer, 3.45 mm along the normal of the cone about the axis x = 0.3, z = 0.05
            slope = 0.010 / 0.160
            off = (math.hypot(x - 0.3, z - 0.05) - 0.040 - slope * (y + 0.1)) / math.hypot(1.0, slope)
            assert off == pytest.approx(3.45e-3, abs=0.1e-3)  # 96 flats of a 50 mm tube lie 0.03 mm inside
    data = json.loads((tmp_path / "out" / "design.json").read_text())
    assert data["frame"] == "the mesh's coordinates in cone.stl"
    assert data["sheets"][0]["fit"]["max_deviation_mm"] < 0.2
    assert "pictures" not in (tmp_path / "out" / "report.md").read_text()


@pytest.mark.long
def test_a_link_of_a_urdf_with_pictures(tmp_path, capsys):
    stl(tmp_path / "cone.stl", list(tube(40.0e-3, 50.0e-3, 160.0e-3)))
    mesh = '<geometry><mesh filename="cone.stl" scale="2 2 2"/></geometry><origin xyz="0 0 1"/>'
    (tmp_path / "arm.urdf").write_text(f'<robot name="r"><link name="arm"><visual>{mesh}</visual></link></robot>')
    assert main(["design", f"{tmp_path / 'arm.urdf'}#arm", "-o", str(tmp_path / "out")]) == 0
    pictures = sorted(path.name for path in (tmp_path / "out" / "pictures").iterdir())
    kinds = ("deviation", "jig", "layout", "parts", "seam", "stack")
    assert pictures == ["link.png", *(f"sheet-1-{kind}.png" for kind in kinds)]
    report = (tmp_path / "out" / "report.md").read_text()
    for name in pictures:
        assert f"(pictures/{name})" in report
        assert (tmp_path / "out" / "pictures" / name).read_bytes().startswith(b"\x89PNG")
    data = json.loads((tmp_path / "out" / "design.json").read_text())
    cone = data["sheets"][0]["link_cone"]
    assert sorted([cone["radius1_mm"], cone["radius2_mm"]]) == pytest.approx(
        [80.0, 100.0], abs=1.0
    )  # its wires take 14 mm
    assert cone["xyz_mm"][0] == pytest.approx(600.0, abs=0.2)
    assert cone["xyz_mm"][2] == pytest.approx(1100.0, abs=0.2)
    assert data["frame"] == "the URDF link arm"
    capsys.readouterr()
    assert design(str(tmp_path / "arm.urdf"), "-o", str(tmp_path / "none")) == 1
    assert "name a link as arm.urdf#LINK; its links are: arm" in capsys.readouterr().err
    assert design(f"{tmp_path / 'arm.urdf'}#leg", "-o", str(tmp_path / "none")) == 1
    assert "no link 'leg'; there are: arm" in capsys.readouterr().err


@pytest.mark.long
def test_the_seam_looks_where_it_is_asked_to(tmp_path):
    stl(tmp_path / "cone.stl", list(tube(0.040, 0.050, 0.160)))
    seam = (-1, 5, 1)
    words = [str(tmp_path / "cone.stl"), "--seam", *map(str, seam), "-o", str(tmp_path / "out")]
    assert design(*words) == 0
    _, placed = sensor_of(tmp_path / "out")
    middle = placed.point(0.05, 0.5 * placed.frustum.wrap)  # opposite to the seam
    want = math.atan2(-seam[2], -seam[0])
    turn = math.atan2(middle[2] - 0.05, middle[0] - 0.3) - want
    assert math.remainder(turn, 2.0 * math.pi) == pytest.approx(0.0, abs=0.01)


@pytest.mark.long
def test_a_cube_has_no_sheet_and_says_why_and_what_is_nearest(tmp_path, capsys):
    corners = [(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)]
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 7, 5),
        (4, 6, 7),
        (0, 5, 1),
        (0, 4, 5),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
    ]
    faces += [(1, 5, 7), (1, 7, 3)]
    stl(tmp_path / "cube.stl", [[corners[i] for i in face] for face in faces])
    assert design(str(tmp_path / "cube.stl"), "-o", str(tmp_path / "out")) == 3
    errors = capsys.readouterr().err
    assert "cube.stl" in errors
    assert "convex hull" in errors
    assert "there is one: radius" in errors
    assert not (tmp_path / "out").exists()
