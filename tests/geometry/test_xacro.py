"""Xacro files: macros, arguments and included packages give the mesh that the expanded URDF gives."""

import sys
from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import MeshError, MissingExtra
from coneskin.geometry.urdf import load_urdf_link, urdf_links

from .synthetic import frustum
from .test_mesh import write_stl

TUBE = frustum(0.05, 0.05, 0.2, segments=24, rings=2)
ARM = """<robot xmlns:xacro="http://ros.org/wiki/xacro" name="arm">
<xacro:arg name="shift" default="0.1"/>
<xacro:macro name="part" params="name">
<link name="${name}"><visual><origin xyz="0 0 ${2 * $(arg shift)}"/><geometry>
<mesh filename="meshes/arm.stl"/></geometry></visual></link>
</xacro:macro>
<xacro:part name="forearm"/></robot>"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    write_stl(tmp_path / "meshes" / "arm.stl", TUBE)
    path = tmp_path / "arm.urdf.xacro"
    path.write_text(ARM)
    return path


def test_a_macro_is_expanded_with_its_arguments(arm: Path) -> None:
    pytest.importorskip("xacrodoc", reason="the extra xacro is not installed")
    assert urdf_links(arm) == ("forearm",)
    low = load_urdf_link(arm, "forearm").vertices[:, 2].min()
    assert load_urdf_link(arm, "forearm", arguments={"shift": "0.3"}).vertices[:, 2].min() == pytest.approx(low + 0.4)
    assert np.ptp(load_urdf_link(arm, "forearm").vertices[:, 2]) == pytest.approx(0.2)


def test_another_package_is_included(arm: Path, tmp_path: Path) -> None:
    pytest.importorskip("xacrodoc", reason="the extra xacro is not installed")
    outer = tmp_path / "elsewhere" / "cell.xacro"
    outer.parent.mkdir()
    outer.write_text(
        '<robot xmlns:xacro="http://ros.org/wiki/xacro" name="cell">'
        '<xacro:include filename="$(find arm_parts)/parts.xacro"/><xacro:tube/></robot>'
    )
    parts = tmp_path / "parts"
    parts.mkdir()
    (parts / "parts.xacro").write_text(
        '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="tube"><link name="tube"><visual><geometry>'
        '<mesh filename="package://arm_parts/tube.stl"/></geometry></visual></link>'
        "</xacro:macro></robot>"
    )
    write_stl(parts / "tube.stl", TUBE)
    assert len(load_urdf_link(outer, "tube", packages={"arm_parts": parts}).faces) > 10
    with pytest.raises(MeshError, match=r"xacro cannot expand it: .*--package NAME=DIR"):
        load_urdf_link(outer, "tube")


def test_what_xacro_cannot_expand_is_said_in_its_words(arm: Path) -> None:
    pytest.importorskip("xacrodoc", reason="the extra xacro is not installed")
    arm.write_text(ARM.replace('<xacro:arg name="shift" default="0.1"/>', ""))
    with pytest.raises(MeshError, match=r"Undefined substitution argument shift.*--xacro-arg NAME=VALUE"):
        urdf_links(arm)
    arm.write_text(ARM.replace("<xacro:part name", "<xacro:piece name"))
    with pytest.raises(MeshError, match=r"xacro cannot expand it: .*piece"):
        urdf_links(arm)


def test_without_the_package_the_pip_line_is_named(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacrodoc", None)
    with pytest.raises(MissingExtra, match=r"expanding arm.urdf.xacro needs .* pip install 'coneskin\[xacro\]'"):
        urdf_links(arm)
