"""Skin of a robot: what the wires buy, what moves beside a sheet, and one scene with all sensors."""

import itertools
import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from coneskin.cli import main
from coneskin.core.errors import GeometryError, MeshError
from coneskin.design import pictures
from coneskin.design.first_scene import _virtual, read_designs
from coneskin.design.robot_design import _renumbered, design_robot
from coneskin.design.sheets.cable_way import SheetBody
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.swept_space import _outside, _swept
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import urdf_joints
from coneskin.scene.reader import parse_scene


def write_robot(folder: Path, stop_z: float) -> Path:
    """Two tubes of 50 and 40 mm; on the second stands an arm that a turn leads around the first, near its far end."""
    first = trimesh.creation.cylinder(0.05, 0.3, sections=96)
    first.export(folder / "first.stl")
    tube = trimesh.creation.cylinder(0.04, 0.2, sections=96)
    tube.apply_translation((0.0, 0.0, 0.3))
    stop = trimesh.creation.box((0.02, 0.02, 0.02))
    stop.apply_translation((0.062, 0.0, stop_z))
    trimesh.util.concatenate([tube, stop]).export(folder / "second.stl")
    links = "".join(
        f'<link name="{name}"><visual><geometry><mesh filename="{file}"/></geometry></visual></link>'
        for name, file in (("upper_arm_link", "first.stl"), ("forearm_link", "second.stl"))
    )
    joint = (
        '<joint name="elbow" type="revolute"><parent link="upper_arm_link"/><child link="forearm_link"/>'
        '<origin xyz="0 0 0" rpy="0 0 0"/><axis xyz="0 0 2"/><limit lower="-9" upper="9"/></joint>'
    )
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="r">{links}{joint}</robot>')
    return path


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ([2], ["of steel", "the seam of sheet 1 faces (0, 0, 1)"]),
        ([1, 3], ["of steel", "the seams of sheets 1 and 2 face (1, 0, 0)"]),
        ([3], ["of steel", "the seam of sheet 1 faces (1, 0, 0)"]),
        ([], ["of steel"]),
    ],
)
def test_notes_speak_of_the_sheets_that_are_left_by_their_new_numbers(numbers: list[int], said: list[str]) -> None:
    notes = ["of steel", "the seam of sheet 2 faces (0, 0, 1)", "the seams of sheets 1 and 3 face (1, 0, 0)"]
    assert list(_renumbered(notes, numbers)) == said


def test_a_joint_has_its_place_its_unit_axis_and_no_more_than_a_turn(tmp_path: Path) -> None:
    (joint,) = urdf_joints(write_robot(tmp_path, 0.1))
    assert (joint.parent, joint.child, joint.axis) == ("upper_arm_link", "forearm_link", (0.0, 0.0, 1.0))
    assert joint.origin == Pose()
    assert (joint.lower, joint.upper) == (-math.pi, math.pi)


@pytest.mark.parametrize(("wires", "share"), [(4, 0.5), (None, 0.0), (None, 1.1), (None, math.nan)])
def test_a_share_is_one_and_excludes_wires(tmp_path: Path, wires: int | None, share: float) -> None:
    with pytest.raises(GeometryError, match="a share is above 0 % and at most 100 %, and excludes wires"):
        design_robot(tmp_path / "arm.urdf", tmp_path / "out", wires, share=share)


def test_a_robot_of_which_a_link_cannot_be_read_is_refused(tmp_path: Path) -> None:
    robot = write_robot(tmp_path, 0.1)
    (tmp_path / "first.stl").unlink()
    with pytest.raises(MeshError, match=r"upper_arm_link: .*first\.stl.*every link is read"):
        design_robot(robot, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_the_wires_buy_the_largest_sheets_and_none_meets_what_turns_beside_it(tmp_path: Path) -> None:
    robot, out = write_robot(tmp_path, 0.1), tmp_path / "skin"
    design = design_robot(robot, out, 4, pictures=False, max_sheets=1)
    assert [one.link for one in design.offered] == ["upper_arm_link", "forearm_link"]
    assert [one.wires for one in design.offered] == [4, 8]
    assert design.offered[1].total == pytest.approx(sum(one.area for one in design.offered))
    assert (design.included, sorted(path.name for path in out.iterdir() if path.is_dir())) == (
        1,
        ["nested", "upper_arm_link"],
    )
    rows = re.findall(r"^\| (\d+) \| (\w+) \|.*\| (yes|no) \|$", (out / "report.md").read_text(), re.MULTILINE)
    assert rows == [("4", "upper_arm_link", "yes"), ("8", "forearm_link", "no")]
    (sheet,) = json.loads((out / "upper_arm_link" / "design.json").read_text())["sheets"]
    cone = sheet["link_cone"]
    side = Frustum(1e-3 * cone["radius1_mm"], 1e-3 * cone["radius2_mm"], 1e-3 * cone["height_mm"])
    body = SheetBody(
        PlacedFrustum(
            side, Pose.from_xyz_rpy([1e-3 * x for x in cone["xyz_mm"]], np.radians(cone["rpy_deg"]).tolist())
        ),
        1e-3 * sheet["thickness_mm"],
    )
    corners = np.array(list(itertools.product((0.052, 0.072), (-0.01, 0.01), (0.09, 0.11))))
    for turn in np.radians(np.arange(0.0, 360.0, 3.0)):
        turned = Pose.from_rotation_vector((0.0, 0.0, float(turn))).apply_all(corners)
        assert not body.near(turned, 2e-3).any(), "the sheet ends before the way of the stop"
    assert any("shortened to clear the next link" in reason for reason in design.reasons)
    wanted = design.offered[0].total / design.offered[1].total
    for share, count in ((wanted, 1), (wanted + 0.01, 2), (1.0, 2)):
        cheapest = design_robot(robot, out, share=share, pictures=False, max_sheets=1, replace=True)
        assert cheapest.included == count, share
    with pytest.raises(GeometryError, match="wires must be at least 4, which a sheet has, got -4"):
        design_robot(robot, tmp_path / "none", -4, pictures=False, max_sheets=1)
    assert not (tmp_path / "none").exists()


@pytest.mark.long
def test_one_scene_takes_the_sensors_of_all_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pictures, "draw_pictures", lambda *_: [])  # of each link: tests/commands has them
    robot = write_robot(tmp_path, 0.42).rename(tmp_path / "ur10e.urdf")
    assert main(["design", f"{robot}#forearm_link", "--wires", "8", "-o", "skin"]) == 1
    assert "--wires is for a whole robot" in capsys.readouterr().err
    assert main(["design", str(robot), "--wires", "8", "--max-sheets", "1", "-o", "skin"]) == 0
    said = capsys.readouterr().out
    assert "4 wires" in said
    assert "8 wires" in said
    assert "next: coneskin init skin --simulated --arm UR10e" in said, "by the name of the file, or a word for xacro"
    assert (tmp_path / "skin" / "curve.png").is_file()
    top, data = (
        (tmp_path / "skin" / "report.md").read_text(),
        json.loads((tmp_path / "skin" / "design.json").read_text()),
    )
    assert {"robot.png", "curve.png", "nested/aluminium-foil-1.dxf"} < set(data["files"])
    assert all((tmp_path / "skin" / file).is_file() for file in data["files"])
    shopping, work = top.partition("## Everything to buy or to cut")[2].split("## Order of work")
    both = ["upper_arm_link sheet 1 part 2", "forearm_link sheet 1 part 2"]
    assert all(part in shopping for part in both), "one list for all sheets"
    assert "| 4-pin wire-to-wire connector, 2.5 mm, plug and socket with 8 crimp contacts | 2 | cable |" in shopping
    assert work.index("| 0 | upper_arm_link") < work.index("| 1 | forearm_link") < work.index("## Yours to decide")
    cables = data["cables"]["cables"]
    assert [cable["sensor"] for cable in cables] == [0, 1]
    assert f"| 1 | forearm_link sheet 1 | {math.ceil(0.1 * cables[1]['length_mm'] + 10) / 100:.2f} | elbow |" in top
    for cable, name in zip(cables, ("upper_arm_link", "forearm_link"), strict=True):
        lead = tomllib.loads((tmp_path / "skin" / name / "sensor.toml").read_text())["lead_ohm"]
        assert lead == pytest.approx([1.0 + cable["ohm"]] * 4, abs=1e-3), "switch and cable"
    assert main(["init", "skin", "--simulated", "--arm", "UR5e"]) == 0
    assert "2 sensors on the upper_arm, forearm" in capsys.readouterr().out
    text = (tmp_path / "scene.toml").read_text()
    assert f"# sensor 1: cable of {1e-3 * cables[1]['length_mm']:.2f} m past elbow to the box at the foot" in text
    scene = parse_scene(text, "scene.toml", tmp_path)
    assert [[item.sensor.sensor_id for item in link.sensors] for link in scene.links] == [[0], [1]]
    for name, number in (("upper_arm_link", 0), ("forearm_link", 1)):
        assert f"| sensor number | {number} |" in (tmp_path / "skin" / name / "report.md").read_text()
    assert "rate_hz" not in (tmp_path / "scene.toml").read_text(), "two sensors find room on one line"
    assert "rate_hz" not in _virtual(read_designs(tmp_path / "skin")[0], 3), "nor do three ask for less than a board's"
    for count, rate in ((4, 150), (6, 100), (9, 100)):
        assert f"rate_hz = {rate} " in _virtual(read_designs(tmp_path / "skin")[0], count)
    assert main(["init", "skin", "--skin-only", "--port", "/dev/null", "-o", "alone.toml"]) == 0
    alone = tomllib.loads((tmp_path / "alone.toml").read_text())
    assert [link["name"] for link in alone["link"]] == ["upper_arm_link", "forearm_link"], "as the URDF names them"


def test_the_outer_face_of_a_sheet_is_sampled_as_densely_as_a_link() -> None:
    """It is kept clear of as the link beneath it: a tab 6 mm above the next link's mesh met that link's sheet."""
    (sheet,) = design_sheets((PlacedFrustum(Frustum(0.05, 0.05, 0.1, 4.0)),), DesignOptions())
    points = _outside(sheet)
    assert np.hypot(*points[:, :2].T) == pytest.approx(0.05 + sheet.options.stack.thickness, abs=1e-9)
    apart = cKDTree(points).query(points, 2)[0][:, 1]
    assert apart.max() <= 2.0 * 1.5e-3 * (1.0 + sheet.options.stack.thickness / 0.05)


@pytest.mark.parametrize("ends", [(-0.3, 0.9), (0.5, 0.5), (-2.9, 2.9), (-4.0, 4.0)])
def test_a_swept_space_is_that_of_its_points_at_every_angle(ends: tuple[float, float]) -> None:
    """A place that is near some point at some angle is always met, one that is near none at any angle never is."""
    rng = np.random.default_rng(3)
    axis = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, 1.0, -0.7))
    radius = 0.02 + 0.04 * rng.random(4000)
    azimuth = 0.3 * rng.random(4000) + np.where(radius < 0.04, math.pi, 0.0)  # its two halves lie opposite each other
    points = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), 0.05 * rng.random(4000)], axis=1)
    asked = 0.2 * rng.random((600, 3)) - 0.1
    away = np.full(600, np.inf)
    for angle in np.linspace(*ends, 120):
        turned = Pose.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angle)).apply_all(points)
        away = np.minimum(away, cKDTree(turned).query(asked)[0])
    space = _swept(axis, points, *ends, asked)
    for distance in (0.0, 0.002, 0.012):
        near = space.near(axis.apply_all(asked), distance)
        assert near[away < distance].all()
        assert not near[away > distance + 0.0035].any()
