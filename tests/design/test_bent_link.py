"""An oval link through the whole chain: mesh, design folder, scene, simulated touch, point on the oval."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import coneskin as cs
from coneskin.design.folder import FileOptions
from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.scene.build import place_on_arm
from coneskin.skin.detection.events import TouchEnded
from coneskin.skin.wire import encode
from tests.support.flat_pattern import locate_flat
from tests.support.ruled_tube import oval_tube

TURN = 2.0 * math.pi
POSE = cs.Pose.from_xyz_rpy((0.01, 0.02, 0.05), (0.1, -0.2, 0.3))


def stadium(flat: float = 0.04, radius: float = 0.03) -> Developable:
    around = 2.0 * (flat + math.pi * radius)
    pieces = [
        (0.5 * flat, 0.0),
        (math.pi * radius, math.pi),
        (flat, 0.0),
        (math.pi * radius, math.pi),
        (0.5 * flat, 0.0),
    ]
    bends = tuple(Bend(TURN * arc / around, turn) for arc, turn in pieces)
    return Developable(cs.Frustum(around / TURN, around / TURN, 0.2), POSE, bends)


def test_layers_of_a_stadium_are_cut_for_their_own_arc() -> None:
    """At the height t the way around is 2 pi t longer, whatever the section, and features keep to their rulings."""
    place = stadium()
    (design,) = cs.design_sheets([place])
    stack = design.options.stack
    lengths = [stack.surface(place, index).radius1 * TURN for index in range(5)]
    around = place.frustum.radius1 * TURN
    assert lengths == pytest.approx([around + TURN * stack.offset(index) for index in range(5)], rel=1e-12)
    widths = {cut.name: cut.bounds[2] - cut.bounds[0] for cut in design.cuts}
    assert widths["lower substrate"] == pytest.approx(lengths[0], rel=1e-9)
    assert widths["upper substrate"] == pytest.approx(lengths[4], rel=1e-9)


def test_the_active_area_lies_at_its_height_above_the_stadium() -> None:
    place = stadium()
    (design,) = cs.design_sheets([place])
    side = design.active.frustum
    points, normals = design.active.place(
        np.linspace(0.0, side.slant, 9)[:, None], np.linspace(0.0, side.wrap, 60)[None]
    )
    height = design.options.stack.face_offset(3) + 0.5 * design.options.stack.layers[3].thickness
    _, phi, off = place.locate_all(points)
    assert off == pytest.approx(height, abs=1e-9)
    feet = place.place(np.zeros(phi.shape), phi)[1]
    assert feet == pytest.approx(normals, abs=1e-9)


def tapered() -> Developable:
    """Return three quarters of a box with two sharp corners, tapered."""
    bends = tuple(Bend(width, turn) for width, turn in ((1.0, 0.1), (0.5, 1.5), (1.6, 0.0), (0.5, 1.6), (1.1, 0.9)))
    return Developable(cs.Frustum(0.05, 0.06, 0.2, 4.7), POSE, bends)


@pytest.mark.parametrize("place", [stadium(), tapered()], ids=["stadium", "tapered box"])
def test_printed_crosses_lie_above_the_places_that_a_calibration_expects(place: Developable) -> None:
    """Each cross is folded with its cover back onto the link; its foot on the active side is the place of its mark."""
    (design,) = cs.design_sheets([place], cs.DesignOptions(face_up="outside"))
    cover, active = design.cuts[6], design.active.frustum
    lines = [s.outline for s in cover.parts[0].strokes if s.kind == "score"]
    middles = [np.mean([(x, y) for x, y, _ in line.vertices], axis=0) for line in lines[::2]]
    u, phi = np.array([locate_flat(cover.surface, x, y) for x, y in middles]).T
    phi = phi + 0.5 * cover.surface.wrap  # a drawing begins in the middle
    above = place.parallel(design.options.stack.offset(4))
    assert above.frustum == cover.surface
    found = design.active.locate_all(above.place(u, phi)[0])
    parts = np.array(
        [(a, b) for row, a in enumerate((0.1, 0.5, 0.9)) for b in ((0.1, 0.5, 0.9), (0.9, 0.5, 0.1))[row % 2]]
    )
    assert found[0] == pytest.approx(parts[:, 0] * active.slant, abs=1e-9)
    tolerance = 1e-9 if place.is_straight else place.mismatch(design.options.stack.offset(4)) / active.radius1
    assert found[1] == pytest.approx(parts[:, 1] * active.wrap, abs=tolerance)
    shares = (phi - phi[0]) / above.frustum.wrap - (found[1] - found[1][0]) / above.frustum.wrap
    assert (
        np.abs(shares * above.frustum.wrap * above.frustum.radius1).max() > 0.3e-3
    )  # shares of the cover would not do


def test_a_bend_that_is_too_sharp_for_the_layers_is_refused() -> None:
    with pytest.raises(cs.GeometryError, match=r"lower substrate is strained"):
        cs.design_sheets([stadium(0.1, 0.0012)])


def test_radii_that_differ_by_rounding_make_no_cone() -> None:
    """The radii of a fit are sums of floats: an oval tube was called a general cone of 0.0000 deg."""
    place = stadium()
    radius = place.frustum.radius1
    assert Developable(cs.Frustum(radius, radius + 1e-12, 0.2), POSE, place.bends).kind == "general cylinder"
    assert Developable(cs.Frustum(radius, radius + 1e-5, 0.2), POSE, place.bends).kind == "general cone"
    assert PlacedFrustum(cs.Frustum(radius, radius - 1e-12, 0.2), POSE).kind == "cylinder"


def test_a_step_file_of_it_is_refused_before_anything_is_drawn(tmp_path: Path) -> None:
    done: list[str] = []
    with pytest.raises(cs.GeometryError, match=r"general cylinder, of which no STEP file .*round_only=true"):
        cs.write_design(
            tmp_path / "out", cs.design_sheets([stadium()]), options=FileOptions(step=True), progress=done.append
        )
    assert not done
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_touch_on_an_oval_link_is_found_on_the_oval(tmp_path: Path) -> None:
    tube = oval_tube(POSE)
    design = cs.design_link(tube.mesh(around=200), tmp_path / "skin", pictures=False)
    (sheet,) = design.sheets
    report = (tmp_path / "skin" / "report.md").read_text(encoding="utf-8")
    assert "general cylinder" in report
    said = re.search(
        r"the link is not round: cones cover (\d+)% of its hull, with a general cylinder it is (\d+)%", report
    )
    assert said is not None
    assert int(said[1]) < 0.75 * int(said[2])
    assert len(design.data["sheets"][0]["bends"]) > 8
    text = '[[link]]\nname = "shell"\n[[link.sensor]]\nfile = "skin/sensor.toml"\n[source]\nkind = "virtual"\n'
    (tmp_path / "scene.toml").write_text(text)
    scene = cs.load_scene(tmp_path / "scene.toml")
    (item,) = place_on_arm(scene)
    (sensor,) = (one.sensor for one in scene.sensors)
    height = sheet.options.stack.face_offset(3) + 0.5 * sheet.options.stack.layers[3].thickness
    for u, part in ((0.05, 0.2), (0.12, 0.45), (0.1, 0.8)):
        phi = part * sensor.frustum.wrap
        touched, outward = sheet.active.point(u, phi), sheet.active.normal(phi)
        skin = cs.VirtualSkin(sensor, [cs.ScriptedTouch(0.05, 0.4, u, phi, 20.0)], duration=0.6)
        stream = cs.TouchStream([sensor])
        events = [event for time, frame in skin.frames() for event in stream.feed(encode(frame), time)]
        (ended,) = (event for event in events if isinstance(event, TouchEnded))
        moved = [event for event in events if isinstance(event, cs.TouchBegan | cs.TouchMoved)][-1]
        point, normal = item.place(moved.u, moved.phi)
        assert ended is not None
        assert math.dist(point, touched) < 1.0e-3  # the decoder's own error of a contact of some millimetres
        assert np.dot(normal, outward) > math.cos(math.radians(2.0))
        foot = np.array(point) - height * np.array(normal)
        assert tube.distances(foot[None])[0] < 0.1e-3
