"""Workbench of the studio: what its handles do, and that it writes what ``coneskin design`` writes."""

import math
import tomllib
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from coneskin.cli import main
from coneskin.core.errors import GeometryError
from coneskin.design.link_design import LinkMesh, design_link
from coneskin.design.studio.design_text import design_facts, deviation_bands, flat_drawing, robot_facts, warning_list
from coneskin.design.studio.studio_page import StudioPage
from coneskin.design.studio.workbench import Handles, RobotLinks, Wish, Workbench, _adjusted
from coneskin.geometry.bend import Bend
from coneskin.geometry.developable import Developable
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.frustum import Frustum, unroll
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.scene.reader import load_scene
from coneskin.view.page_server import PageServer
from tests.geometry.fit.test_seam_place import tube_with_wing
from tests.geometry.synthetic import placed, revolve
from tests.support.ruled_tube import oval_tube

FULL = PlacedFrustum(Frustum(0.04, 0.06, 0.20), Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, 0.5, -0.6)))
ROUND = math.tau * 0.03 + 0.08  # m; around a stadium of two flats of 40 mm and two half circles of 60 mm
BENDS = tuple(
    Bend(math.tau * arc / ROUND, turn)
    for arc, turn in ((0.02, 0.0), (math.pi * 0.03, math.pi), (0.04, 0.0), (math.pi * 0.03, math.pi), (0.02, 0.0))
)
OVAL = Developable(Frustum(ROUND / math.tau, ROUND / math.tau, 0.20), FULL.link_frustum, BENDS)
PART = PlacedFrustum(Frustum(0.04, 0.06, 0.20, math.radians(200.0)), FULL.link_frustum)
HANDLES = Handles(0, 0.03, 0.12, math.radians(150.0), math.radians(20.0))


@pytest.mark.parametrize("found", [FULL, PART, OVAL], ids=["a full wrap", "a partial wrap", "an oval"])
def test_an_adjusted_sheet_lies_within_the_found_one(found: PlacedFrustum) -> None:
    sheet = _adjusted(found, HANDLES)
    for u in (0.0, sheet.frustum.slant):
        for phi in (0.0, 1.0, sheet.frustum.wrap):
            was_u, was_phi, off = found.locate(sheet.point(u, phi))
            assert off == pytest.approx(0.0, abs=1e-12)
            assert was_phi == pytest.approx(phi + math.radians(20.0))
            along = was_u / found.frustum.slant * found.frustum.height
            assert along == pytest.approx(0.03 if u == 0.0 else 0.15)
            assert sheet.normal(phi) == pytest.approx(found.normal(was_phi))


@pytest.mark.parametrize("found", [FULL, OVAL], ids=["a cone", "an oval"])
def test_nothing_set_changes_nothing(found: PlacedFrustum) -> None:
    assert _adjusted(found, Handles()) == found


def test_a_seam_that_is_turned_on_an_oval_leaves_it_where_it_was() -> None:
    turned = _adjusted(OVAL, Handles(seam=math.radians(60.0)))
    assert turned.frustum == OVAL.frustum
    assert turned.point(0.05, 0.4) == pytest.approx(OVAL.point(0.05, 0.4 + math.radians(60.0)), abs=1e-12)


@pytest.mark.long
def test_an_oval_link_is_found_shown_and_written(tmp_path: Path) -> None:
    """The colours of the bands say what the tube is: its corners lie on the sheet, within the height of its facets."""
    mesh = oval_tube(FULL.link_frustum, 0.1).mesh(around=120)
    made = Workbench.of(LinkMesh("oval", mesh, "its own", ()))
    (sheet,) = made.wish.fit.sheets
    bands = deviation_bands(RayCaster(mesh), sheet.placed, made.wish.fit.tolerance)
    assert {(band.low < 0.0 or band.high > 0.0) and max(-band.low, band.high) < 5e-4 for band in bands} == {True}
    length = sheet.frustum.height - 0.015
    made.handle(0, Handles(0, 0.01, length, math.radians(200.0), math.radians(30.0)))
    assert "general cylinder</td>" in design_facts(made.designs)
    made.write(tmp_path / "skin", pictures=False)
    text = (tmp_path / "skin" / "sensor.toml").read_text(encoding="utf-8")
    assert "bend_wrap_deg" in text
    (tmp_path / "scene.toml").write_text(
        '[[link]]\nname = "shell"\n[[link.sensor]]\nfile = "skin/sensor.toml"\n[source]\nkind = "virtual"\n'
    )
    (item,) = load_scene(tmp_path / "scene.toml").links[0].sensors
    assert item.placed.point(0.03, 1.0) == pytest.approx(made.designs[0].active.point(0.03, 1.0), abs=1e-6)


@pytest.mark.long
def test_what_nobody_touched_is_written_as_by_design(tmp_path: Path) -> None:
    """A tube with a wing at its foot, behind which the seam goes."""
    link = LinkMesh("wing", tube_with_wing(0.7), "its own", ())
    made = Workbench.of(link)
    assert any("the link itself shields" in note for note in made.seam_notes())
    made.write(tmp_path / "studio", pictures=False)
    design_link(link.mesh, tmp_path / "design", pictures=False)
    written = [tomllib.loads((tmp_path / name / "sensor.toml").read_text()) for name in ("studio", "design")]
    for one in written:
        one.pop("name", None)
    assert written[0] == written[1]


def test_a_partial_wrap_is_not_turned_beyond_what_was_found() -> None:
    sheet = _adjusted(PART, Handles(wrap=math.radians(150.0), seam=math.radians(170.0)))
    _, last, _ = PART.locate(sheet.point(0.05, sheet.frustum.wrap))
    assert last == pytest.approx(PART.frustum.wrap)


@pytest.mark.parametrize(
    "handles", [Handles(along=0.195), Handles(along=-0.01), Handles(length=0.005), Handles(wrap=0.0)]
)
def test_what_is_no_sheet_is_refused(handles: Handles) -> None:
    with pytest.raises(GeometryError):
        _adjusted(FULL, handles)


@pytest.fixture
def bench() -> Workbench:
    """A cone of 40 to 55 mm with shorter ones at its ends; the search for cones has tests of its own."""
    mesh = placed(revolve([(0.0, 0.030), (0.02, 0.040), (0.18, 0.055), (0.20, 0.03)], 96, 4), Pose())
    side = PlacedFrustum(Frustum(0.040, 0.055, 0.16), Pose(translation=(0.0, 0.0, 0.02)))
    sheet = FittedSheet(side, 2e-4, 1e-4, 0.0, 0.0, 0.8, 0.8, 0.0)
    fit = LinkFit((sheet,), None, 1e-3, 0.2, 0.05, (), "", 1)
    wish = Wish(fit, (Handles(),), ("the seam of sheet 1 faces nowhere",))
    return Workbench(LinkMesh("a <link>", mesh, "its own", ("a <note>",)), wish)


def test_the_bands_show_how_far_the_link_is_off_the_sheet(bench: Workbench) -> None:
    (sheet,) = bench.wish.fit.sheets
    rays = RayCaster(bench.link.mesh)
    on_it = {band.low for band in deviation_bands(rays, sheet.placed, 0.001)}
    assert on_it == {-0.001 / 7.0} or max(map(abs, on_it)) < 0.0005
    cone = sheet.frustum
    inside = PlacedFrustum(
        Frustum(cone.radius1 - 0.0008, cone.radius2 - 0.0008, cone.height), sheet.placed.link_frustum
    )
    bands = deviation_bands(rays, inside, 0.001)
    assert all(band.low < 0.0008 for band in bands)
    strongest = max(bands, key=lambda band: len(band.faces))
    assert strongest.low < 0.0008 * math.cos(cone.half_angle) < strongest.high
    assert strongest.colour[0] > 2 * strongest.colour[2], "what stands out is red"
    assert sum(len(band.faces) for band in bands) == 2 * 40 * 96


def test_a_handle_designs_the_sheet_again_and_is_said(bench: Workbench) -> None:
    bench.handle(0, Handles(along=0.02, length=0.10))
    assert bench.designs[0].place.frustum.height == pytest.approx(0.10)
    assert "height, wrap</td><td style='padding-right:8px'>100.0 mm" in design_facts(bench.designs)
    bench.handle(0, Handles(along=0.155))
    assert bench.designs == ()
    assert "it needs 10 mm" in bench.warnings()[0]
    bench.undo()
    assert bench.designs[0].place.frustum.height == pytest.approx(0.10)


@pytest.mark.long
def test_moves_of_one_handle_are_undone_at_once(bench: Workbench) -> None:
    whole = bench.wish
    for step in range(1, 5):
        bench.handle(0, Handles(along=0.01 * step), again=step > 1)
    bench.handle(0, Handles(along=0.04, wrap=5.0))
    bench.undo()
    assert bench.wish.handles == (Handles(along=0.04),)
    bench.undo()
    bench.undo()  # there is nothing before
    assert bench.wish == whole


def test_a_seam_that_was_turned_is_said_where_it_is(bench: Workbench) -> None:
    assert "the seam of sheet 1 faces nowhere" in bench.warnings()
    bench.handle(0, Handles(seam=math.radians(90.0)))
    assert bench.seam_notes() == ("the seam of sheet 1 faces (0.00, 1.00, 0.00) of the link's frame",)
    assert bench.designs[0].place.link_frustum.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))


@pytest.mark.long
def test_a_sheet_is_added_where_its_side_is_bare_and_deleted(bench: Workbench) -> None:
    with pytest.raises(GeometryError, match="surface 1 is covered all along"):
        bench.add(0)
    bench.handle(0, Handles(along=0.10))
    bench.add(0)
    assert bench.wish.handles[1].along == 0.0
    assert bench.wish.handles[1].length == pytest.approx(0.10 - bench.options.sheet_gap)
    assert bench.places == (0, 1)
    first, second = (design.place for design in bench.designs)
    assert second.frustum.radius1 == pytest.approx(0.040)
    assert first.centre(0.0)[2] > second.centre(second.frustum.slant)[2]
    assert "<b>8 wires</b>" in design_facts(bench.designs)
    bench.delete(0)
    assert [design.name for design in bench.designs] == ["sheet 1"]
    assert bench.designs[0].place.frustum.radius1 == pytest.approx(0.040)
    bench.delete(0)
    assert (bench.designs, bench.places) == ((), ())
    bench.add(0)
    assert bench.wish.handles == (Handles(),)


def test_each_layer_has_its_own_r1(bench: Workbench) -> None:
    """The page said r1 of the bare link beside a drawing of a layer on it."""
    facts = design_facts(bench.designs)
    for cut in bench.designs[0].cuts:
        assert f"{cut.name}</td><td style='padding-right:8px'>{1e3 * unroll(cut.surface).r1:.1f}<" in facts


def test_links_of_a_robot_stand_where_its_joints_are_at_zero(tmp_path: Path) -> None:
    """Two tubes of 0.2 m: the second one at a joint that cannot reach 0, but 90 deg."""
    for name in ("first", "second"):
        (tmp_path / f"{name}.stl").write_bytes(stl(placed(revolve([(0.0, 0.04), (0.2, 0.04)], 24, 2), Pose())))
    robot = tmp_path / "robot.urdf"
    link = '<link name="{0}"><visual><geometry><mesh filename="{0}.stl"/></geometry></visual></link>'
    robot.write_text(
        f"""<robot name="two">{link.format("first")}{link.format("second")}<joint name="j" type="revolute">
        <parent link="first"/><child link="second"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
        <limit lower="{math.pi / 2}" upper="3" effort="1" velocity="1"/></joint></robot>"""
    )
    links = RobotLinks(str(robot), lambda link: Workbench(link, Wish(LinkFit((), None, 1e-3, 0, 0, (), "none", 1), ())))
    poses = links.poses()
    assert poses["first"] == Pose()
    assert poses["second"].apply((0.0, 0.0, 0.1)) == pytest.approx((0.1, 0.0, 0.2))
    assert links.open("second") is links.open("second")
    facts = robot_facts(
        [(name, links.opened[name].designs if name in links.opened else "not opened") for name in links.names]
    )
    assert "first</td><td style='padding-right:8px'>not opened" in facts
    assert "second</td><td style='padding-right:8px'>0<" in facts


def test_what_a_file_says_is_never_taken_for_html(bench: Workbench) -> None:
    drawn = flat_drawing(bench.designs[0].cuts[0])
    assert "<link>" not in drawn + warning_list(bench.warnings()) + design_facts(bench.designs)
    assert "&lt;note&gt;" in warning_list(bench.warnings())
    assert drawn.count("<svg") == 1


@pytest.mark.long
def test_it_writes_the_folder_that_a_scene_reads(bench: Workbench, tmp_path: Path) -> None:
    bench.handle(0, Handles(along=0.02))
    files = bench.write(tmp_path / "skin", pictures=False)
    assert {"report.md", "sensor.toml", "design.json"} <= set(files)
    assert sum(name.startswith("cut/") and name.endswith(".dxf") for name in files) >= 7
    scene = tmp_path / "scene.toml"
    scene.write_text('[[link]]\nname = "tube"\n[[link.sensor]]\nfile = "skin/sensor.toml"\n')
    (sensor,) = load_scene(scene).sensors
    assert sensor.placed.frustum.height == pytest.approx(bench.designs[0].active.frustum.height, abs=1e-6)
    with pytest.raises(GeometryError, match="skin"):
        bench.write(tmp_path / "skin", pictures=False)


def stl(mesh: Mesh) -> bytes:
    corners = mesh.vertices[mesh.faces]
    record = np.zeros(len(corners), np.dtype([("n", "<3f4"), ("v", "<9f4"), ("a", "<u2")]))
    record["v"] = corners.reshape(-1, 9)
    return bytes(80) + len(corners).to_bytes(4, "little") + record.tobytes()


def test_the_studio_is_served_at_its_port_and_takes_files(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is served")
    server = Mock(side_effect=KeyboardInterrupt)
    monkeypatch.setattr("coneskin.view.page_server.PageServer", server)
    assert main(["studio", "link.stl", "--port", "8123"]) == 130
    server.assert_called_once_with("coneskin studio", port=8123, uploads=True)


def test_the_page_draws_says_what_it_did_and_takes_another_link(bench: Workbench, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is served")
    other: list[LinkMesh] = []

    def load(link: LinkMesh) -> Workbench:
        other.append(link)
        return bench

    with PageServer("studio", port=18190, uploads=True) as server:
        page = StudioPage(server, bench, tmp_path / "skin", False, load)
        nodes = set(server.scene._handle_from_node_name)
        assert {"/link", "/sheets/sheet 1/A", "/sheets/sheet 1/B", "/sheets/sheet 1/C", "/sheets/sheet 1/D"} <= nodes
        assert "cm2" in page._facts.content
        assert "<svg" in page._flat.content
        page._upload = SimpleNamespace(value=SimpleNamespace(name="../evil<b>.txt", content=b"x"))
        page._take_upload()
        assert "&lt;b&gt;.txt is no" in page._said.content
        page._upload.value = SimpleNamespace(name="../../tube.stl", content=b"solid nothing")
        page._take_upload()
        assert "tube.stl" in page._said.content
        assert other == []
        page._upload.value = SimpleNamespace(name="../../tube.stl", content=stl(bench.link.mesh))
        page._take_upload()
        assert [link.name for link in other] == ["tube"]
        assert "1 sheet" in page._said.content


@pytest.mark.long
def test_a_link_that_takes_long_replaces_none_that_was_dropped_after_it(bench: Workbench, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is served")
    data = stl(bench.link.mesh)

    def load(link: LinkMesh) -> Workbench:
        if link.name == "slow":  # while its sheets are looked for
            page._upload.value = SimpleNamespace(name="quick.stl", content=data)
            page._take_upload()
        return Workbench(link, bench.wish)

    with PageServer("studio", port=18190, uploads=True) as server:
        page = StudioPage(server, bench, tmp_path / "skin", False, load)
        page._upload = SimpleNamespace(value=SimpleNamespace(name="slow.stl", content=data))
        page._take_upload()
        assert page._bench.link.name == "quick"
        assert "quick.stl: 1 sheet" in page._said.content


@pytest.mark.long
def test_two_sheets_over_one_another_leave_no_room_for_a_third(bench: Workbench) -> None:
    bench.handle(0, Handles(along=0.05))
    bench.add(0)
    bench.handle(1, Handles())
    with pytest.raises(GeometryError, match="surface 1 is covered all along"):
        bench.add(0)


def test_what_was_sought_for_one_link_is_not_taken_for_another(bench: Workbench, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is served")
    with PageServer("studio", port=18190, uploads=True) as server:
        page = StudioPage(server, bench, tmp_path / "skin", False, lambda _: bench)
        other = Workbench(bench.link, bench.wish)
        page._change(lambda bench: bench.delete(0), of=other)
        assert page._bench is bench
        assert len(bench.wish.handles) == 1


def test_a_folder_of_others_is_not_replaced_by_a_second_press(bench: Workbench, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is served")
    own = tmp_path / "skin" / "design.json"
    own.parent.mkdir()
    own.write_text('{"name": "mine"}')
    with PageServer("studio", port=18190, uploads=True) as server:
        page = StudioPage(server, bench, own.parent, False, lambda _: bench)
        page._written()
        assert "press again" in page._told.content
        page._written()
        assert "is not a design" in page._told.content
        assert own.read_text() == '{"name": "mine"}'
