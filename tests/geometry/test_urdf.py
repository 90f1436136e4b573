"""Links out of a URDF: origin, scale, packages, and clear words for what is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import MeshError
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import joints_inwards, load_urdf_link, urdf_joints, urdf_links

from .synthetic import frustum
from .test_mesh import write_dae, write_stl

TUBE = frustum(0.05, 0.04, 0.3, segments=24, rings=2)
ORIGIN = '<origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/>'


def write_urdf(folder: Path, body: str) -> Path:
    file = folder / "robot.urdf"
    file.write_text(f'<robot name="r"><link name="world"/><link name="arm">{body}</link></robot>')
    return file


def visual(name: str, origin: str = "", scale: str = "", tag: str = "visual") -> str:
    return f'<{tag}>{origin}<geometry><mesh filename="{name}" {scale}/></geometry></{tag}>'


def test_origin_is_applied(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE)
    mesh = load_urdf_link(write_urdf(tmp_path, visual("arm.stl", ORIGIN)), "arm")
    pose = Pose.from_xyz_rpy((0.1, 0.2, 0.3), (0.1, -0.2, 0.3))
    back = np.array([pose.inverse().apply((x, y, z)) for x, y, z in mesh.vertices])
    np.testing.assert_allclose(np.ptp(back, axis=0), [0.1, 0.1, 0.3], atol=1e-7)
    assert back[:, 2].min() == pytest.approx(0.0, abs=1e-7)
    assert mesh.source.endswith("robot.urdf: arm")


def test_scale_brings_millimetres_to_metres_without_a_guess(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE, 1000.0)
    mesh = load_urdf_link(write_urdf(tmp_path, visual("arm.stl", "", 'scale="0.001 0.001 0.001"')), "arm")
    np.testing.assert_allclose(mesh.size, [0.1, 0.1, 0.3], atol=1e-7)


def test_numbers_of_a_urdf_are_metres(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE, 1000.0)
    with pytest.raises(MeshError, match="300 m long"):
        load_urdf_link(write_urdf(tmp_path, visual("arm.stl")), "arm")


def test_collada_tells_its_own_unit(tmp_path: Path) -> None:
    write_dae(tmp_path / "arm.dae", (TUBE[0] * 1000.0, TUBE[1]), '<unit name="mm" meter="0.001"/>')
    mesh = load_urdf_link(write_urdf(tmp_path, visual("arm.dae")), "arm")
    assert mesh.size[2] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("where", ["beside", "above", "named"])
def test_packages_are_found(tmp_path: Path, where: str) -> None:
    package = tmp_path / "src" / "my_robot"
    (package / "meshes").mkdir(parents=True)
    write_stl(package / "meshes" / "arm 1.stl", TUBE)
    folder = {"beside": tmp_path / "src" / "other", "above": package / "urdf", "named": tmp_path / "far"}[where]
    folder.mkdir()
    file = write_urdf(folder, visual("package://my_robot/meshes/arm%201.stl"))
    packages = {"my_robot": package} if where == "named" else None
    assert load_urdf_link(file, "arm", packages=packages).size[2] == pytest.approx(0.3, abs=1e-7)


def test_file_uri(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE)
    file = write_urdf(tmp_path, visual(f"file://{tmp_path / 'arm.stl'}"))
    assert load_urdf_link(file, "arm").size[2] == pytest.approx(0.3, abs=1e-7)


def test_parts_become_one_mesh(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE)
    both = visual("arm.stl") + visual("arm.stl", '<origin xyz="0 0 0.5"/>')
    mesh = load_urdf_link(write_urdf(tmp_path, both), "arm")
    assert len(mesh.faces) == 2 * len(TUBE[1])
    assert mesh.size[2] == pytest.approx(0.8, abs=1e-7)


def test_collision_is_another_mesh(tmp_path: Path) -> None:
    write_stl(tmp_path / "arm.stl", TUBE)
    write_stl(tmp_path / "hull.stl", frustum(0.06, 0.06, 0.31, segments=8))
    file = write_urdf(tmp_path, visual("arm.stl") + visual("hull.stl", tag="collision"))
    assert load_urdf_link(file, "arm", "collision").size[2] == pytest.approx(0.31, abs=1e-7)
    assert urdf_links(file) == ("arm",)


@pytest.mark.parametrize(
    ("body", "link", "words"),
    [
        ("", "arm", "arm has no visual mesh, nothing"),
        (visual("arm.stl", tag="collision"), "arm", "no visual mesh, nothing; its collision has a mesh"),
        (
            '<visual><geometry><cylinder radius="1" length="2"/></geometry></visual>',
            "arm",
            "no visual mesh, only cylinder",
        ),
        (visual("arm.stl"), "leg", "no link 'leg'; there are: arm"),
        (visual("none.stl"), "arm", r"none\.stl: No such file"),
        (visual("package://nowhere/arm.stl"), "arm", "nowhere is neither above nor beside .*--package nowhere=DIR"),
        (visual("http://x/arm.stl"), "arm", "named by package://, file:// or a path, got http://"),
        (visual("arm.stl", '<origin xyz="0 0"/>'), "arm", "xyz of arm must be 3 numbers, got '0 0'"),
        (visual("arm.stl", "", 'scale="a b c"'), "arm", "scale of arm must be 3 numbers"),
    ],
)
def test_what_is_missing_is_named(tmp_path: Path, body: str, link: str, words: str) -> None:
    write_stl(tmp_path / "arm.stl", TUBE)
    with pytest.raises(MeshError, match=words):
        load_urdf_link(write_urdf(tmp_path, body), link)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot><link", "malformed XML"),
        ("<sdf/>", "begins with <robot>, this file with <sdf>"),
    ],
)
def test_what_is_no_urdf(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    with pytest.raises(MeshError, match=words):
        load_urdf_link(file, "arm")
    with pytest.raises(MeshError, match="No such file"):
        load_urdf_link(tmp_path / "none.urdf", "arm")
    with pytest.raises(MeshError, match="'visual' or 'collision', got 'both'"):
        load_urdf_link(file, "arm", "both")


def test_a_joint_that_slides_stays_where_it_is_nearest_to_zero(tmp_path: Path) -> None:
    file = tmp_path / "slide.urdf"
    file.write_text(
        """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic"><parent link="a"/>
        <child link="b"/><origin xyz="0 0 0.3"/><axis xyz="0 0 2"/><limit lower="0.1" upper="0.5"/></joint></robot>"""
    )
    (joint,) = urdf_joints(file)
    assert joint.origin.translation == pytest.approx((0.0, 0.0, 0.4))
    assert (joint.lower, joint.upper) == (0.0, 0.0)


@pytest.mark.parametrize("names", [("../a", "b"), ("/a", "b"), ("..", "b"), ("a", "a"), ("", "b")])
def test_a_link_whose_name_is_no_folder_of_its_own_is_refused(tmp_path: Path, names: tuple[str, str]) -> None:
    file = tmp_path / "r.urdf"
    link = '<link name="{}"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>'
    file.write_text(f"<robot name='r'>{''.join(map(link.format, names))}</robot>")
    with pytest.raises(MeshError, match="the name of a link must be its own"):
        urdf_links(file)


LIMIT = '<limit lower="-1" upper="1"/>'


@pytest.mark.parametrize(
    ("joints", "limit", "words"),
    [
        ("ab bc ca", LIMIT, "joints form a tree.*'b' does"),
        ("ab cb", LIMIT, "joints form a tree.*'b' does"),
        ("aa", LIMIT, "joints form a tree.*'a' does"),
        ("ab bd", LIMIT, "no link of the file has that name"),
        ("ab", "", "joint j: a revolute joint needs a limit with lower and upper"),
        ("ab", f'{LIMIT}<axis xyz="0 0 0"/>', "joint j: the axis of a revolute joint must not be 0 0 0"),
        ("ab", '<limit lower="1" upper="-1"/>', "got 1 and -1"),
        ("ab", '<limit lower="nan" upper="1"/>', "got nan and 1"),
    ],
)
def test_joints_that_are_no_tree_are_refused(tmp_path: Path, joints: str, limit: str, words: str) -> None:
    file, joint = tmp_path / "r.urdf", '<joint name="j" type="revolute"><parent link="{}"/><child link="{}"/>{}</joint>'
    bodies = "".join(joint.format(*pair, limit) for pair in joints.split())
    file.write_text(f"<robot name='r'><link name='a'/><link name='b'/><link name='c'/>{bodies}</robot>")
    with pytest.raises(MeshError, match=words):
        urdf_joints(file)


def test_an_axis_of_a_fixed_joint_is_nothing_and_a_planar_joint_is_refused(tmp_path: Path) -> None:
    """CAD programs write zeros for the axis of what they fix."""
    text = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="{}"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 0"/></joint></robot>'
    )
    file = tmp_path / "r.urdf"
    file.write_text(text.format("fixed"))
    assert urdf_joints(file)[0].axis == (1.0, 0.0, 0.0)
    file.write_text(text.format("planar"))
    with pytest.raises(MeshError, match="joint j: a joint is revolute, continuous, prismatic or fixed, got 'planar'"):
        urdf_joints(file)


def test_frames_without_a_mesh_are_passed_on_the_way_to_the_base(tmp_path: Path) -> None:
    joint = '<joint name="{0}{1}" type="fixed"><parent link="{0}"/><child link="{1}"/></joint>'
    bodies = "".join(f'<link name="{name}"/>' for name in "abcd") + "".join(
        joint.format(*pair) for pair in ("ab", "bc")
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{bodies}</robot>')
    joints = urdf_joints(tmp_path / "r.urdf")
    inner, between = joints_inwards("c", joints, {"a", "c"})
    assert (inner, [one.name for one in between]) == ("a", ["bc", "ab"])
    assert joints_inwards("a", joints, {"a", "c"}) == joints_inwards("d", joints, {"a"}) == ("", ())
