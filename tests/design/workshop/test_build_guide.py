"""Build guide: each sheet has its own steps, and its figures are those of the drawings and of the sensor."""

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.design.design_toml import DESIGN_TABLES
from coneskin.design.sheets.sheet_design import DesignOptions, JigPlan, SheetDesign, design_sheets
from coneskin.design.sheets.summary import sensor_toml
from coneskin.design.workshop.build_figures import BuildFigures, bill_of_materials, measure_build
from coneskin.design.workshop.build_guide import common_lines, sheet_lines
from coneskin.design.workshop.placement import find_datum_faces, find_placement, sharpest_bends
from coneskin.geometry.developable import Bend, Developable
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.drawing.surface_shape import SheetSide, drawing_point
from coneskin.geometry.drawing.touch_marks import CoverMarks, marks_on_link
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.geometry.pose import Pose
from coneskin.skin.sensor import sheet_resistances

from .test_datum_faces import elbow

CONE = Frustum(0.045, 0.060, 0.15)
SIDES: tuple[SheetSide, ...] = ("end1", "end2", "edge0", "edge1")


def built(frustum: Frustum, **options: object) -> tuple[SheetDesign, BuildFigures]:
    (design,) = design_sheets([PlacedFrustum(frustum)], DesignOptions(**options))  # type: ignore[arg-type]
    return design, measure_build(design, 0)


def guide(design: SheetDesign, figures: BuildFigures, folder: str = ".") -> str:
    return "\n".join([*common_lines([design], [figures]), *sheet_lines(design, figures, folder)])


def test_without_a_mesh_it_says_how_far_the_active_area_is_from_the_edges_that_are_drawn() -> None:
    design, figures = built(Frustum(0.045, 0.045, 0.15, math.radians(300.0)))
    text = " ".join(sheet_lines(design, figures, "."))
    away, turned = (float(x) for x in re.findall(r"end 1 is at z = ([\d.]+) mm, .* points ([\d.]+) deg past", text)[0])
    pose = tomllib.loads(sensor_toml(design, 0, "any"))
    assert pose["xyz_mm"] == pytest.approx([0.0, 0.0, away], abs=0.05)
    assert pose["rpy_deg"] == pytest.approx([0.0, 0.0, turned], abs=0.05)
    assert away > 5.0
    assert turned > 5.0


def test_common_steps_are_told_once_and_a_sheet_has_two_pages_of_its_own() -> None:
    """The wires of the second sheet leave at the other end; each row that a step names is in the sheet's table."""
    designs = design_sheets(double_cone(0.04, 0.07, 0.04, 0.15, 0.15))
    figures = [measure_build(design, index) for index, design in enumerate(designs)]
    common = "\n".join(common_lines(designs, figures))
    steps = [int(word) for word in re.findall(r"^(\d+)\. ", common, re.MULTILINE)]
    assert steps == list(range(1, len(steps) + 1))
    named = set(re.findall(r"(?<=[ (])\*([A-Za-z][\w -]*)\*", common))
    named -= {"Check", "Place", "italics", "outside up", "inside up"}
    for number, (design, item) in enumerate(zip(designs, figures, strict=True), 1):
        text = "\n".join(sheet_lines(design, item, f"sheet-{number}", number - 1))
        rows = dict(re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", text, re.MULTILINE))
        assert text.startswith(f"## Sheet {number}\n")
        assert rows["tabs"] == f"over end {number}"
        assert rows["sensor number"] == str(number - 1)
        assert rows["files"] == f"`sheet-{number}/cut/`, `sheet-{number}/sensor.toml`"
        assert rows[f"end {3 - number}"] == f"joint 1: meets end {number} of sheet {3 - number}"
        assert {"conductive sheet", "part 1", "collars", "cable"} <= named <= set(rows)
        assert len(text.split()) < 1000, "two pages"
        for cut in design.cuts:
            labels = [label.text for part in cut.parts for label in part.labels]
            assert ("END 1 (B) JOINT 1" in labels) == (number == 2 and cut.number not in (2, 6))
    assert "press each sheet in turn" in common, "exchanged plugs of sheets with the same ohms"
    assert designs[0].cuts[6].face == "outside", "the labels of the cover are read on the link"


@pytest.mark.parametrize("assembly", ["loose", "pairs", "bonded"])
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.long
def test_every_part_has_its_step_and_its_face(assembly: str, side: SheetSide) -> None:
    from coneskin.geometry.drawing.layer_stack import PAPER_STACK

    stack = replace(PAPER_STACK, assembly=assembly)  # type: ignore[arg-type]
    wrap = math.pi if side.startswith("edge") else math.tau
    design, figures = built(Frustum(0.054, 0.054, 0.2, wrap), stack=stack, wires=side)
    text = guide(design, figures)
    steps = text.split("### Place")[0]
    for part in (1, 3, 4, 5, 7):
        assert re.search(rf"\b[Pp]arts? {part}\b|\b1 and 3\b|\b5 and 7\b", steps)
    assert f"part 3 on the bench, {design.cuts[2].face} up" in steps
    assert ("Prick the centres" in steps) == (assembly != "loose"), "only a cover that is wrapped last is outside up"
    marked = sum(
        stroke.outline.closed for part in design.cuts[6].parts for stroke in part.strokes if stroke.kind == "score"
    )
    assert marked == (assembly != "loose"), "where part 5 is glued"
    assert ("lead the wires out on the bare link beside that edge" in steps) == side.startswith("edge")


@pytest.mark.parametrize("side", ["end1", "end2"])
def test_a_sheet_reads_what_its_conductive_layers_measure_between_their_electrodes(side: SheetSide) -> None:
    """Summed over thin rings, resp. wires: the sheets reach beyond the electrodes of the other one."""
    design, figures = built(CONE, wires=side, upper_sheet_ohms=500.0, lower_sheet_ohms=2000.0)
    radial, angular = figures.pairs
    field, plan = design.layout.field, design.layout.plan
    sine = math.sin(math.atan2(0.015, 0.15))
    cosine = math.cos(math.atan2(0.015, 0.15))
    u = np.linspace(field.u1, field.u2, 20001)
    radius = 0.045 + 3.45e-3 * cosine + u * sine
    spread = 2 * math.pi - (plan.setback + 2 * (plan.lead + plan.clearance) + 0.0) / 0.045 - plan.setback / 0.045
    assert radial.ohms == pytest.approx(500 * np.trapezoid(1 / radius, u) / spread, rel=0.03)  # lead beside the wedge
    u = np.linspace(plan.setback, CONE.slant - plan.setback, 20001)
    radius = 0.045 + 2.55e-3 * cosine + u * sine
    assert angular.ohms == pytest.approx(2000 * (field.phi2 - field.phi1) / np.trapezoid(1 / radius, u), rel=1e-6)
    for pair, nominal in ((radial, 500.0), (angular, 2000.0)):
        assert 0.7 < pair.ohms / (pair.squares * nominal) < 1.0
    fitted = sheet_resistances(design.active.frustum, radial.ohms / radial.squares, angular.ohms / angular.squares)
    assert fitted == pytest.approx((radial.ohms, angular.ohms))


@pytest.mark.parametrize("side", ["end1", "end2"])
@pytest.mark.parametrize("tab", [0.0, 0.012])
@pytest.mark.long
def test_wires_reach_one_connector_by_the_shorter_way(side: SheetSide, tab: float) -> None:
    design, figures = built(Frustum(0.054, 0.054, 0.2), plan=ElectrodePlan(tab=tab), wires=side)
    way = design.way
    assert [wire.electrode for wire in figures.wires] == ["A", "B", "C", "D"]
    assert [wire.pin for wire in figures.wires] == [1, 2, 3, 4]
    for wire in figures.wires:
        across = abs(math.remainder(wire.phi - way.phi, 2 * math.pi)) * 0.054
        assert across < 0.03, "the tabs are beside each other, some across the seam"
        needed = 8.0 + 1e3 * (across + way.connector_length) + 20.0 + 4.0  # mm; stripped, loop, in the contact
        assert 1e3 * wire.length == pytest.approx(5.0 * math.ceil(needed / 5.0 - 1e-6)), "to the next 5 mm"
    assert way.connector_length == pytest.approx(0.06, abs=6e-3)
    assert way.tie_length == pytest.approx(0.03, abs=4e-3), "half way to the connector"


def test_a_connector_is_as_far_as_a_hand_reaches() -> None:
    (least,) = (1e-3 * key.low for key in DESIGN_TABLES["sheet"][1] if key.name == "connector_mm")
    built(CONE, connector=least)
    for wrong in (1e-3, least - 1e-6):
        with pytest.raises(GeometryError, match="the connector must be 30 to 2000 mm from the rim"):
            built(CONE, connector=wrong)


def bumped(azimuth: float | None) -> Mesh:
    """A tube of 50 mm about z from -0.03 to 0.25, with a cone that stands out at an azimuth and z = 0.24."""
    phi = np.linspace(0, 2 * math.pi, 73)[:-1]
    ring = np.stack([0.05 * np.cos(phi), 0.05 * np.sin(phi)], axis=1)
    low, high = (np.column_stack([ring, np.full(72, z)]) for z in (-0.03, 0.25))
    faces = [f for i in range(72) for f in ((i, (i + 1) % 72, 72 + i), ((i + 1) % 72, 72 + (i + 1) % 72, 72 + i))]
    corners = [*low, *high]
    if azimuth is not None:
        corners.append(np.array([0.08 * math.cos(azimuth), 0.08 * math.sin(azimuth), 0.24]))
        faces.append((72, 73, 144))
    return Mesh(np.array(corners), np.array(faces))


@pytest.mark.parametrize("azimuth", [0.3, 3.0, 6.0])
def test_a_sheet_is_placed_from_what_the_link_shows(azimuth: float) -> None:
    pose = Pose.from_xyz_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    place = find_placement(PlacedFrustum(Frustum(0.05, 0.05, 0.2), pose), bumped(azimuth).moved(pose))
    assert place.before == pytest.approx(0.03)
    assert place.beyond == pytest.approx(0.05)
    assert place.around1 == pytest.approx(2 * math.pi * 0.05)
    assert place.seam == pytest.approx(pose.rotate((1.0, 0.0, 0.0)))
    assert place.feature is not None
    assert place.feature.azimuth == pytest.approx(azimuth)
    assert place.feature.arc == pytest.approx(azimuth * 0.05)
    assert place.feature.end == 2


def test_a_round_link_has_nothing_to_measure_the_seam_from() -> None:
    place = find_placement(PlacedFrustum(Frustum(0.05, 0.05, 0.2)), bumped(None))
    assert place.feature is None
    assert place.before == pytest.approx(0.03)
    collar = bumped(None)
    wide = collar.vertices * np.where(collar.vertices[:, 2:] > 0.2, (1.5, 1.5, 1.0), (1.0, 1.0, 1.0))
    assert find_placement(PlacedFrustum(Frustum(0.05, 0.05, 0.2)), Mesh(wide, collar.faces)).feature is None


def test_coordinates_of_the_file_are_those_of_the_drawing() -> None:
    design, figures = built(CONE, link="forearm")
    data = figures.as_data(design)
    assert len(data["holes"]) == 3
    surface = design.cuts[5].surface
    for corner in data["electrodes"]["A"]:
        x, y = surface.flat_point(1e-3 * corner["u_mm"], math.radians(corner["phi_deg"]) - 0.5 * surface.wrap)
        assert (corner["x_mm"], corner["y_mm"]) == pytest.approx((1e3 * x, 1e3 * y), abs=2e-3)
        millimetres = [value for name, value in corner.items() if name.endswith("_mm")]
        assert millimetres == [float(f"{value:.3f}") for value in millimetres], "in thousandths"
    assert any("tab_width_mm" in corner for corner in data["electrodes"]["C"])
    assert data["untouched_frame"]["radial_current"] > 100
    for cut in design.cuts:
        texts = [label.text for part in cut.parts for label in part.labels]
        assert any("forearm: sheet 1" in text for text in texts), f"the link is named on part {cut.number}"


def test_the_bill_counts_every_sheet() -> None:
    designs = design_sheets(double_cone(0.04, 0.07, 0.04, 0.15, 0.15), DesignOptions(plan=ElectrodePlan()))
    figures = [measure_build(design, index) for index, design in enumerate(designs)]
    bill = {item: quantity for item, quantity, _ in bill_of_materials(designs, figures)}
    assert bill["4-pin wire-to-wire connector, 2.5 mm, plug and socket with 8 crimp contacts"] == "2"
    assert bill["plastic pin with flat head, 2.4 x 8 mm"] == "6"
    chosen, figure = built(CONE)  # with holes of another width
    pins = {item: quantity for item, quantity, _ in bill_of_materials([*designs, chosen], [*figures, figure])}
    assert (pins["plastic pin with flat head, 2.4 x 8 mm"], pins["plastic pin with flat head, 1.9 x 8 mm"]) == (
        "6",
        "3",
    )
    net = sum(part.area for design in designs for k in (0, 6) for part in design.cuts[k].parts)
    assert bill["silicone foam sheet 2.50 mm"].startswith(f"{1e4 * net:.0f} cm2 net")


def test_the_bends_of_an_oval_and_of_a_rounded_box_show_where_edge_0_is() -> None:
    """Quarter turns of 10 mm between planes of 40 and 60 mm; edge 0 in the middle of a plane, and in a corner."""
    corner, long, short = 0.010 * math.pi / 2, 0.060, 0.040
    arcs = [0.5 * long, corner, short, corner, long, corner, short, corner, 0.5 * long]
    radius = sum(arcs) / (2 * math.pi)
    turns = [math.pi / 2 if k % 2 else 0.0 for k in range(9)]
    bends = tuple(Bend(arc / radius, turn) for arc, turn in zip(arcs, turns, strict=True))
    place = Developable(Frustum(radius, radius, 0.2), Pose(), bends)
    middles = [0.5 * long + 0.5 * corner]
    for plane in (short, long, short):
        middles.append(middles[-1] + plane + corner)
    found = sharpest_bends(place)
    assert [bend for bend, _ in found] == pytest.approx([0.010] * 4)
    assert [way for _, way in found] == pytest.approx(middles, abs=1e-5)
    turned = sharpest_bends(place.turned(middles[0] / radius))
    assert sorted(min(way, 2 * math.pi * radius - way) for _, way in turned)[0] == pytest.approx(0.0, abs=1e-5)
    assert sharpest_bends(PlacedFrustum(Frustum(radius, radius, 0.2))) == []


def test_a_sheet_beyond_whose_edge_something_stands_out_is_placed_by_a_straight_line() -> None:
    """A tape measure does not follow the link there: the distance of the two points, by their coordinates."""
    (design,) = design_sheets([PlacedFrustum(Frustum(0.05, 0.05, 0.2, math.radians(200)))], DesignOptions())
    text = guide(design, measure_build(design, 0, "mesh", bumped(4.5)))
    exact = math.dist((0.05, 0.0, 0.2), (0.08 * math.cos(4.5), 0.08 * math.sin(4.5), 0.24))
    assert f"{1e3 * exact:.1f} mm straight through the air, from edge 0 at end 2 (257.8 deg)" in text
    assert "around end 2, in the direction of the wrap (257.8" not in text
    assert "| +y | 78.5 mm (90.0 deg) |" in text
    assert "| -y |" not in text, "no place of the sheet faces there"


def test_distances_from_faces_are_told_of_the_edges_and_ends_that_they_are_of() -> None:
    mesh = elbow(Pose())
    place = PlacedFrustum(Frustum(0.03, 0.035, 0.06, 3.5), Pose.from_xyz_rpy((0.01, 0.0, 0.02), (0.5, 0.9, 0.3)))
    (design,) = design_sheets([place], DesignOptions())
    faces = {f"from {face.name}": face for face in find_datum_faces(mesh)}
    text = guide(design, measure_build(design, 0, "elbow", mesh, faces=tuple(faces.values())))
    (names,) = re.findall(r"^\| place of the sheet \| (.+) \|$", text, re.MULTILINE)
    slant = design.place.frustum.slant
    for end, u in ((1, 0.0), (2, slant)):
        for where, phi in (("edge 0", 0.0), ("the other edge", 3.5)):
            (told,) = re.findall(rf"^\| end {end}, {where} \| (.+) \|$", text, re.MULTILINE)
            point = design.place.place(u, phi)[0].reshape(3)
            for name, said in zip(names.split(" | "), told.split(" | "), strict=True):
                assert float(said.strip("*").removesuffix(" mm")) == pytest.approx(
                    1e3 * float(faces[name].height(point)), abs=0.051
                )


def test_the_play_of_a_collar_is_told_at_its_own_end() -> None:
    design, figures = built(CONE)
    text = guide(design, replace(figures, collars=tuple(replace(one, play=0.1) for one in figures.collars)))
    side = design.place.frustum
    for end, radius in ((1, side.radius1), (2, side.radius2)):
        (said,) = re.findall(rf"^\* End {end}: .* be turned by 6 deg \(([\d.]+) mm\) at most", text, re.MULTILINE)
        assert float(said) == pytest.approx(1e3 * 0.1 * radius, abs=0.051)


def test_the_measured_sheets_are_what_the_guide_says_a_perfect_sheet_gives() -> None:
    """A short sheet: what lies beside its active area carries most of the current, and the guide says so."""
    design, figures = built(Frustum(0.054, 0.049, 0.036, math.radians(210)), plan=ElectrodePlan())
    text = guide(design, figures, "sheet-2")
    ab, cd = figures.pairs
    assert cd.ohms / cd.squares < 0.5 * cd.sheet_ohms
    for name, pins, pair in (("upper", "1-2", ab), ("lower", "3-4", cd)):
        row = f"| {name}_sheet_ohm | reading {pins} divided by {pair.squares:.4f}, nominally "
        assert f"{row}{pair.ohms / pair.squares:.4g} |" in text


def test_marks_to_touch_are_in_the_table_and_on_the_drawing() -> None:
    design, figures = built(CONE)
    rows = re.findall(r"\| mark (\d) to touch \| ([\d.]+) \| ([\d.]+) \|", guide(design, figures))
    assert [int(row[0]) for row in rows] == list(range(1, 10))
    surface = design.cuts[6].surface
    stack, flat = design.options.stack, design.layout
    drawn = list(CoverMarks(flat, surface, marks_on_link(flat, stack, design.place)).labels())
    for (_, u, phi), label in zip(rows, drawn, strict=True):
        x, y = drawing_point(surface, 1e-3 * float(u), math.radians(float(phi)))
        assert math.dist((x, y), (label.x, label.y)) < 8e-3


def test_what_a_person_reads_is_what_the_design_says_in_the_units_that_are_printed() -> None:
    design, figures = built(CONE, wires="end1", upper_sheet_ohms=500.0, lower_sheet_ohms=2000.0)
    common = "\n".join(common_lines([design], [figures]))
    for said in (
        "a square of 40 mm with a square hole of 20 mm",
        "half of (hole - square + 20 mm). These files have 0 mm",
        "within 20% of the table's",
        "strip 8.0 mm of each wire",
        "fold that half (6.0 mm) over them",
        "walls of 3.0 mm solid",
        "the gap to both is 0.3 mm",
    ):
        assert said in common, said
    rows = dict(re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", "\n".join(sheet_lines(design, figures, ".")), re.MULTILINE))
    cone, way = design.cuts[0].surface, design.way
    sine = (cone.radius2 - cone.radius1) / cone.slant
    chord = 2.0 * cone.radius1 / sine * math.sin(0.5 * cone.wrap * sine)  # of the sector
    along = f"{1e3 * cone.slant:.1f} mm from end 1 to end 2 along an edge"
    assert rows["part 1"] == f"{along}, {1e3 * chord:.1f} mm straight between the corners of end 1"
    assert rows["conductive sheet"] == "2000 ohm per square (part 3), 500 ohm per square (part 5)"
    assert rows["pins"] == f"3 of {1e3 * design.layout.plan.hole:.1f} mm less 0.1 mm"
    gap = 2.0 * math.pi * 0.15 / CONE.slant * 0.05  # of tape of 50 um around the cone, once for each of five layers
    assert rows["seam"] == f"opens by {gap:.1f} mm for each layer of tape, at most {5.0 * gap:.1f} mm at part 7"
    beyond = [-1e3 * float(way.surface[index][0]) for index in (way.tie, -1)]
    lies = [f"the {what} lies {u:.1f} mm beyond end 1" for what, u in zip(("tie", "connector"), beyond, strict=True)]
    assert all(said in rows["cable"] for said in lies)
    assert f"{1e3 * way.tie_length:.1f} mm along the cable" in rows["cable"]
    assert rows["cable"].endswith(f"{1e3 * way.connector_length:.1f} mm along the cable")
    for name, pair in zip(("A-B", "C-D"), figures.pairs, strict=True):
        value, unit = re.match(r"([\d.]+) (k?ohm) for", rows[name]).groups()  # type: ignore[union-attr]
        assert float(value) * (1e3 if unit == "kohm" else 1.0) == pytest.approx(pair.ohms, rel=0.01)
    assert rows["upper_sheet_ohm"].startswith(f"reading 1-2 divided by {figures.pairs[0].squares:.4f}, nominally ")


def ending_at(low: float, high: float) -> Mesh:
    """A tube of 50 mm about z that ends at two heights."""
    tube = bumped(None)
    heights = np.where(tube.vertices[:, 2:] > 0.1, high, low)
    return Mesh(np.concatenate([tube.vertices[:, :2], heights], axis=1), tube.faces)


@pytest.mark.parametrize(("low", "high", "end"), [(-0.1, 0.202, "end 1"), (-0.005, 0.3, "end 2")])
def test_a_cable_lies_where_the_link_goes_on(low: float, high: float, end: str) -> None:
    mesh = ending_at(low, high)
    (design,) = design_sheets([PlacedFrustum(Frustum(0.05, 0.05, 0.2))], DesignOptions(), mesh=mesh)
    text = guide(design, measure_build(design, 0, "mesh", mesh))
    assert f"| tabs | over {end} |" in text
    assert "bolted to the link" not in text
    assert low < design.way.points[:, 2].min() < design.way.points[:, 2].max() < high


def test_wires_of_an_end_near_the_rim_stay_on_the_link_and_one_goes_around_its_bare_side() -> None:
    mesh = ending_at(-0.0042, 0.0742)
    place = PlacedFrustum(Frustum(0.05, 0.05, 0.07, math.radians(200)))
    (design,) = design_sheets([place], DesignOptions(wires="end1"), mesh=mesh)
    text = guide(design, measure_build(design, 0, "mesh", mesh))
    (row,) = [line for line in text.splitlines() if line.startswith("| tabs |")]
    assert "only 4.2 mm of the link lie beyond its line" in row
    assert row.endswith("led around the bare side of the link, taped to it in line with end 1: the wire of C |")


@pytest.mark.parametrize(
    ("u", "said"), [(-0.004, "4.0 mm beyond end 1"), (0.006, "6.0 mm inwards of the line of end 1")]
)
def test_a_cable_that_leaves_beside_an_end_is_measured_without_a_sign(u: float, said: str) -> None:
    place = PlacedFrustum(Frustum(0.05, 0.05, 0.07, math.radians(200)))
    (design,) = design_sheets([place], DesignOptions(wires="edge0"))
    moved = replace(design, way=replace(design.way, u=u))
    assert f"| cable | from edge 0, {said}; the tie" in guide(moved, measure_build(design, 0))


@pytest.mark.parametrize("hole", [0.0, 2.5e-3])
def test_a_sheet_without_pins_says_what_stops_a_mirrored_part(hole: float) -> None:
    design, figures = built(CONE, plan=ElectrodePlan(hole=hole))
    text = "\n".join(common_lines([design], [figures]))
    assert ("The corner at the tabs has no hole: a mirrored part does not fit" in text) == bool(hole)
    assert ("sides of one name lie over each other" in text) == (not hole)


def test_a_link_without_room_at_either_end_carries_its_cable_on_what_is_bolted_to_it() -> None:
    mesh = ending_at(-0.001, 0.062)
    (design,) = design_sheets([PlacedFrustum(Frustum(0.05, 0.05, 0.06))], DesignOptions(), mesh=mesh)
    text = guide(design, measure_build(design, 0, "mesh", mesh))
    assert "bolted to the link there" in text
    assert "glue the mount on part 7" in text


def test_only_a_sheet_whose_edges_meet_has_a_seam() -> None:
    """Of a partial wrap the guide speaks of two edges."""
    for wrap, seam in ((2 * math.pi, True), (math.pi, False)):
        design, figures = built(Frustum(0.054, 0.054, 0.2, wrap))
        assert design.has_seam == seam
        assert ("The *seam*: the edges of every part meet" in guide(design, figures)) == seam


@pytest.mark.parametrize("side", ["edge0", "edge1"])
def test_wires_at_an_edge_of_a_full_wrap_stand_up_from_the_seam_and_lie_over_it(side: SheetSide) -> None:
    """Between edges that meet no tab lies flat; over the seam no touch is located."""
    design, figures = built(Frustum(0.045, 0.06, 0.2), wires=side)
    way, axis = design.way, design.place.link_frustum.inverse()
    heights = np.array([design.place.frustum.locate(*axis.apply(tuple(point)))[2] for point in way.points])
    assert heights == pytest.approx(design.options.stack.thickness), "on the outer face"
    box = design.layout.active
    off = np.abs(np.array([math.remainder(phi, math.tau) for _, phi in way.surface])) * design.place.frustum.radius1
    assert off.max() < min(box.phi1, math.tau - box.phi2) * 0.045, "over what locates no touch"
    assert (way.connector_length, way.tie_length) == (pytest.approx(0.06), pytest.approx(0.03, abs=4e-3))
    text = guide(design, figures)
    assert "they stand up between the two edges of the seam" in text
    assert "all of it on part 7, over the seam" in text
    assert not figures.as_data(design)["cable"]["on_link"]
    assert built(Frustum(0.045, 0.06, 0.2))[0].layout.plan.wires.startswith("end"), "only where it is asked for"
    with pytest.raises(GeometryError, match="there is no free way of 60 mm for the cable"):
        built(Frustum(0.05, 0.05, 0.04), wires=side)


def test_the_bill_has_what_the_steps_use_up() -> None:
    (design,) = design_sheets([PlacedFrustum(Frustum(0.05, 0.05, 0.2))], DesignOptions())
    figures = measure_build(design, 0, "mesh", ending_at(-0.1, 0.3))
    items = {item: quantity for item, quantity, _ in bill_of_materials([design], [figures])}
    plastic = sum(part.surface.volume for collar in figures.collars for part in collar.parts)
    assert items["PLA or PETG, for a 3D printer"].startswith(f"{1e6 * plastic:.0f} cm3")
    strap = items["hook-and-loop tape 15 to 20 mm wide"]
    assert strap == "2 pieces of 400 mm", "around the link, 314 mm, and 80 mm on itself"
    assert items["masking tape 19 mm wide"] == "1 m"
    assert items["self-adhesive cable-tie mount 19 x 19 mm and cable tie 2.5 mm"] == "1"
    assert items["copper tape with electrically conductive adhesive, 6 x 12 mm"] == "4"
    edges = [s.outline.length for k in (1, 5) for part in design.cuts[k].parts for s in part.strokes]
    assert items["polyimide tape 0.03 mm, 10 mm wide"] == f"{math.ceil(5.0 * sum(edges)) / 10.0:.1f} m"
    red = sum(1e3 * wire.length for wire in figures.wires if wire.electrode == "A")
    assert items["stranded wire 0.14 mm2, red"] == f"{red:.0f} mm"
    sheet = next(item for name, item in items.items() if name.startswith("conductive sheet"))
    assert "a strip of 20 x 120 mm to measure" in sheet, "step 2 measures a strip of it"
    faces = sum(part.area for cut in design.cuts if cut.number in (1, 3, 5) for part in cut.parts)
    rims = 2.0 * (2.0 * 0.2 + 2.0 * math.pi * (0.05 + 0.05))  # m, around part 4, on both its faces
    (tape,) = (item for name, item in items.items() if name.startswith("double-sided silicone adhesive"))
    assert tape == f"{1e4 * 1.15 * (faces + 0.003 * rims):.0f} cm2", "strips of 3 mm, and 15 % for offcuts"
    text = guide(design, figures)
    assert "hook-and-loop tape" in text
    assert "isopropanol" in text
    assert any("isopropanol" in name for name in items)


def test_what_no_ruler_reaches_is_not_told() -> None:
    """A part that stands out 0.5 m away is no place to measure from; at 0.13 m it is (above)."""
    (design,) = design_sheets(
        [PlacedFrustum(Frustum(0.05, 0.05, 0.2, math.radians(200)))], DesignOptions(jig=JigPlan("none"))
    )
    mesh = bumped(4.5)
    for reach, told in ((0.1, True), (0.5, False)):
        far = np.array(mesh.vertices)
        far[-1] = reach * math.cos(4.5), reach * math.sin(4.5), 0.24
        text = guide(design, measure_build(design, 0, "mesh", Mesh(far, mesh.faces)))
        assert ("through the air" in text) == told


def test_an_end_at_the_links_own_end_is_told_for_a_tilted_sheet_too() -> None:
    design, figures = built(Frustum(0.05, 0.05, 0.2))
    for before, beyond in ((0.002, 0.02), (0.02, 0.002)):
        place = replace(figures.placement, before=before, beyond=beyond, tilted=True)
        text = guide(design, replace(figures, placement=place))
        assert ("| line of end 1 | 2.0 mm along the axis" in text) == (before < 0.01)
        assert ("| line of end 2 | outermost place" in text) == (beyond < 0.01)
        assert "Nothing stands out from the link by which edge 0 could be found" in text
        assert "The link is not round" not in text, "a round one has no bend to lay a marked strip of paper by"
