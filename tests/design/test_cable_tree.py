"""Cables of a robot's sheets: loops that are long enough, and ways that meet nothing and lie on nothing that senses."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from coneskin.design.cable_lattice import CableLattice, length_of
from coneskin.design.cable_tree import CableRouter, CableTree, bundle_radius, loop_length
from coneskin.design.robot_design import _cable_section
from coneskin.design.sheets.cable_way import SphereBody
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, design_sheets
from coneskin.design.swept_space import _swept, _swept_beside
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import UrdfJoint

RANGE = (-1.5, 2.5)
ALLOWANCE = math.pi * 0.03  # m; two quarter bends of 30 mm
near = st.floats(-0.3, 0.3)
ends = st.tuples(near, near, near).map(np.array)
#: no place beside the seam where nothing senses is as wide as a cable
SLIM = ElectrodePlan(wires="end1", margin=0.5e-3, electrode=0.5e-3, setback=0.2e-3, lead=0.5e-3, hole=0.0)


@given(ends, ends, st.floats(-7.0, 7.0), st.floats(0.0, 13.0), st.floats(0.0, 1.0))
def test_a_loop_is_never_shorter_than_the_straight_way(
    child: np.ndarray, parent: np.ndarray, lower: float, turn: float, share: float
) -> None:
    angle = lower + share * turn
    moved = Pose.from_rotation_vector((0.0, 0.0, angle)).apply_all(child[None])[0]
    straight = float(np.linalg.norm(moved - parent))
    assert loop_length(child, parent, (lower, lower + turn)) >= straight + ALLOWANCE - 1e-9


def test_a_loop_past_a_joint_without_a_range_is_the_gap_and_its_bends() -> None:
    child, parent = np.array([0.05, 0.0, 0.1]), np.array([0.05, 0.0, 0.07])
    assert loop_length(child, parent, (0.0, 0.0)) == pytest.approx(0.03 + ALLOWANCE)
    assert loop_length(child, parent, (0.0, 0.0), 0.2) == pytest.approx(0.23 + ALLOWANCE), "a joint that slides"
    turned = loop_length(child, parent, (0.5, 2.5))
    assert turned == pytest.approx(0.03 + 0.05 * 2.5 + ALLOWANCE), "by the larger turn of the two"
    endless = loop_length(child, parent, (-math.inf, math.inf))
    assert endless == loop_length(child, parent, (-math.pi, math.pi))


def tube(radius: float, low: float, high: float) -> Mesh:
    body = trimesh.creation.cylinder(radius, segment=[[0.0, 0.0, low], [0.0, 0.0, high]], sections=96)
    return Mesh(np.array(body.vertices), np.array(body.faces))


JOINT = UrdfJoint("elbow", "base", "arm", Pose(), (0.0, 0.0, 1.0), *RANGE, RANGE, 0.0)
MESHES = {"base": tube(0.05, 0.0, 0.3), "arm": tube(0.04, 0.301, 0.5)}


def sheet_on(link: str, side: Frustum, z: float, plan: ElectrodePlan | None = None) -> SheetDesign:
    place = PlacedFrustum(side, Pose.from_xyz_rpy((0.0, 0.0, z)))
    return design_sheets((place,), DesignOptions(plan=plan, wires=plan and plan.wires, connector=0.04), MESHES[link])[0]


def beside(link: str) -> dict[str, SphereBody]:
    """The other tube, which turns about its own axis."""
    other = "arm" if link == "base" else "base"
    points = trimesh.sample.sample_surface(trimesh.Trimesh(MESHES[other].vertices, MESHES[other].faces), 8000, seed=1)[
        0
    ]
    return {other: _swept(Pose(), points, *RANGE, MESHES[link].vertices)}


def laid(*sheets: tuple[str, SheetDesign], joint: UrdfJoint = JOINT) -> CableTree:
    return CableRouter((joint,), MESHES, sheets, beside).tree()


@cache
def robot() -> tuple[tuple[tuple[str, SheetDesign], ...], CableTree]:
    """A full wrap on the base, past whose seam the cable of the arm's sheet must go."""
    full = sheet_on("base", Frustum(0.05, 0.05, 0.1), 0.12)
    sheets = ("base", full), ("arm", sheet_on("arm", Frustum(0.04, 0.04, 0.1, 4.0), 0.36))
    return sheets, laid(*sheets)


def test_a_way_meets_nothing_and_lies_on_nothing_that_senses() -> None:
    """Independent of its search: by points on all bodies, and on the other link at angles over the range."""
    sheets, tree = robot()
    assert tree.reasons == ()
    passed = [section.place for section in tree.cables[1]]
    assert passed == ["arm", "elbow", "base"]
    for sensor, sections in enumerate(tree.cables):
        for section in sections:
            if section.limits:
                continue
            radius = bundle_radius(2 if section.place == "base" else 1)
            corners = section.points[1:] if section is sections[0] else section.points  # it begins in its connector
            steps = (a + np.linspace(0.0, 1.0, 30)[:, None] * (b - a) for a, b in pairwise(corners))
            line = np.concatenate([corners, *steps])
            others = [on_link(section.place)]
            other = on_link("arm" if section.place == "base" else "base")
            others += [Pose.from_rotation_vector((0.0, 0.0, q)).apply_all(other) for q in np.linspace(*RANGE, 9)]
            others += [
                face(sheet, (0.0, sheet.place.frustum.slant), (0.0, sheet.place.frustum.wrap))
                for name, sheet in sheets
                if name == section.place
            ]
            away = [float(cKDTree(points).query(line)[0].min()) for points in others]
            assert min(away) >= radius, (sensor, section.place, away)
            for name, sheet in sheets:
                box = sheet.layout.active
                if name == section.place:  # as far to the side as above
                    sensing = face(sheet, (box.u1, box.u2), (box.phi1, box.phi2))
                    assert cKDTree(sensing).query(line)[0].min() >= 1.4 * radius


def test_no_place_is_where_the_next_link_moves() -> None:
    """The arm stands on the end of the base, on which cables would find room otherwise."""
    places = CableLattice(MESHES["base"], (), list(beside("base").values()), 0.004).places
    assert places[:, 2].max() > 0.304, "some are on that end, beside the arm"
    assert cKDTree(on_link("arm")).query(places)[0].min() >= 0.004


def on_link(name: str) -> np.ndarray:
    return np.array(
        trimesh.sample.sample_surface(trimesh.Trimesh(MESHES[name].vertices, MESHES[name].faces), 100_000, seed=2)[0]
    )


def face(sheet: SheetDesign, u: Sequence[float], phi: Sequence[float]) -> np.ndarray:
    return sheet.outer_face(*np.meshgrid(np.linspace(*u, 100), np.linspace(*phi, 300)))[0].reshape(-1, 3)


def test_cables_share_their_way_and_are_summed() -> None:
    _, tree = robot()
    short, long = (cable[-1].points for cable in tree.cables)
    assert np.array_equal(short[-1], long[-1]), "one place at the foot"
    assert long[-1, 2] < 0.025
    standing = CableLattice(MESHES["base"], (), (), 0.004, np.array([0.0, 0.0, 1.0]))
    assert standing.places[:, 2].min() >= 0.004, "none goes through what the robot stands on"
    assert [(section.place, sensors) for section, sensors in tree.bundles()] == [
        ("base", (0, 1)),
        ("elbow", (1,)),
        ("arm", (1,)),
    ]
    assert tree.length(1) == pytest.approx(0.3 + sum(section.length for section in tree.cables[1]))
    loop = tree.cables[1][1]
    assert loop.length == pytest.approx(float(loop_length(loop.points[0], loop.points[1], RANGE)))
    assert tree.cables[1][2].length == pytest.approx(length_of(long))
    assert tree.ohms(1) == pytest.approx(0.13 * tree.length(1), rel=0.01)
    said = "\n".join(_cable_section(tree, [sheet for _, sheet in robot()[0]]))
    assert f"| elbow | {tree.ohms(1):.2f} |" in said
    assert tree.as_data()["cables"][1]["sections"][1]["range_deg"] == pytest.approx(np.degrees(RANGE), abs=1e-3)


def test_the_foot_is_where_the_base_is_bolted_down_even_from_a_ceiling() -> None:
    sheets, tree = robot()
    turned = Pose.from_rotation_vector((math.pi, 0.0, 0.0))
    mount = replace(JOINT, name="mount", parent="world", child="base", origin=turned, lower=0.0, upper=0.0)
    hung = CableRouter((replace(mount, limits=(0.0, 0.0)), JOINT), MESHES, sheets, lambda _: {}).tree()
    assert hung.cables[1][-1].points[-1, 2] < 0.025, "in the frame of the base"
    assert tree.cables[1][-1].points[-1, 2] < 0.025


def test_a_sweep_passes_frames_without_a_body() -> None:
    """A frame before the joint, or one shifted along its axis behind it, changes nothing but how it is written."""
    direct = _swept_beside("base", [JOINT], MESHES, {})["arm"].points
    still = replace(JOINT, name="flange", origin=Pose(), lower=0.0, upper=0.0, limits=(0.0, 0.0))
    up = Pose(translation=(0.0, 0.0, 0.01))
    aside = Pose(translation=(0.02, 0.0, 0.01))
    before = replace(still, child="frame", origin=aside), replace(JOINT, parent="frame", origin=aside.inverse())
    behind = (
        replace(JOINT, child="frame", origin=JOINT.origin @ up.inverse()),
        replace(still, parent="frame", origin=up),
    )
    for joints in (before, behind):
        for link in ("base", "arm"):
            own = _swept_beside(link, joints, MESHES, {})
            assert list(own) == [{"base": "arm", "arm": "base"}[link]]
        swept = _swept_beside("base", joints, MESHES, {})["arm"].points
        assert cKDTree(direct).query(swept)[0].max() < 3e-3
        assert cKDTree(swept).query(direct)[0].max() < 3e-3
    raised = _swept_beside("base", [replace(JOINT, origin=up)], MESHES, {})["arm"].points
    assert cKDTree(up.apply_all(direct)).query(raised)[0].max() < 3e-3, "it stands where its joint does"


def test_a_cable_without_a_way_is_named_with_what_bars_it() -> None:
    sheets = robot()[0]
    full = sheet_on("base", Frustum(0.05, 0.05, 0.1), 0.12, SLIM)
    tree = laid(("base", full), sheets[1])
    assert tree.cables[0], "it leaves towards the foot, or there is none"
    assert tree.cables[1] == ()
    assert "No cable is laid for sensor 1: a bundle of 8 mm finds no way past sheet 1 on base." in tree.reasons
    assert (tree.length(1), tree.ohms(1)) == (0.0, 0.0)
    filled = CableRouter((JOINT,), MESHES, sheets, lambda _: {"": SphereBody(MESHES["base"].vertices, 1.0)}).tree()
    assert filled.reasons == ("No cable is laid for sensor 0, 1: no place at the foot of base is free.",)


def test_a_frame_without_a_body_may_lie_between_two_links_but_no_second_joint() -> None:
    sheets = robot()[0]
    fixed = replace(JOINT, name="flange", child="frame", lower=0.0, upper=0.0, limits=(0.0, 0.0))
    outer = replace(JOINT, parent="frame")
    nothing = SphereBody(np.empty((0, 3)), 1e-3)
    for known in ({}, {"arm": nothing, "base": nothing}):
        tree = CableRouter((fixed, outer), MESHES, sheets, lambda _, known=known: known).tree()
        assert [section.place for section in tree.cables[1]] == ["arm", "elbow", "base"]
    two = CableRouter((replace(JOINT, child="frame"), outer), MESHES, sheets, lambda _: {}).tree()
    assert two.reasons == ("No cable is laid for sensor 1: between arm and base there is more than one joint.",)


def test_a_joint_that_winds_its_cables_up_is_named_with_limits_that_shorten_the_loop() -> None:
    sheets, tree = robot()
    section = tree.cables[1][1]
    for limits, words in (((-6.0, 6.0), "turns by 688 deg and winds"), ((-math.inf, math.inf), "has no limits")):
        wound = CableTree((tree.cables[0], (replace(section, limits=limits),)), ())
        assert words in "\n".join(_cable_section(wound, [sheet for _, sheet in sheets]))
    assert "deg" not in "\n".join(_cable_section(tree, [sheet for _, sheet in sheets]))
