"""Strip over a seam: with it, every azimuth of a full wrap is in the active area of one sensor."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

import coneskin as cs
from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, _blind_angle, cover_seams, design_sheets
from coneskin.design.workshop.build_figures import measure_build
from coneskin.design.workshop.build_guide import sheet_lines
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.geometry.pose import Pose

SHAPES = {
    "cylinder": Frustum(0.054, 0.054, 0.2),
    "widening": Frustum(0.045, 0.06, 0.15),
    "narrow": Frustum(0.07, 0.05, 0.2),
}
POSE = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, 0.5, 0.6))


def active_azimuths(design: SheetDesign, base: Pose) -> tuple[float, float]:
    """Azimuths about the axis of a pose at which the active area begins and ends."""
    box, side = design.layout.active, design.place.frustum
    found = []
    for phi in (box.phi1, box.phi2):
        x, y, _ = base.inverse().apply(design.place.link_frustum.apply(side.point(0.5 * side.slant, phi)))
        found.append(math.atan2(y, x))
    return found[0], found[1]


@pytest.mark.parametrize("gap", [0.0, 2e-3])
@pytest.mark.parametrize("side", ["end1", "end2"])
@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.long
def test_sheet_and_strip_together_close_the_turn(name: str, side: SheetSide, gap: float) -> None:
    options = DesignOptions(cover_seam=True, wires=side, seam_gap=gap)
    sheet, strip = cover_seams(design_sheets([PlacedFrustum(SHAPES[name], POSE)], options))
    assert (strip.name, strip.above) == ("sheet 2", "sheet 1")
    begin, end = active_azimuths(sheet, POSE)
    strip_begin, strip_end = active_azimuths(strip, POSE)
    assert math.remainder(strip_begin - end, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert math.remainder(strip_end - begin, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert math.radians(10) < _blind_angle(sheet) < math.radians(45)
    assert _blind_angle(sheet) == pytest.approx(2 * math.pi - _blind_angle(strip))
    outer = sheet.options.stack.thickness
    for u in (0.0, 0.1):  # it lies on the outer face, its ends flush
        point = POSE.inverse().apply(strip.place.link_frustum.apply(strip.place.frustum.point(u, 0.3)))
        found, _, height = SHAPES[name].locate(*point)
        assert (found, height) == (pytest.approx(u, abs=1e-9), pytest.approx(outer, abs=1e-9))


@pytest.mark.long
def test_only_full_wraps_have_a_seam_to_cover() -> None:
    options = DesignOptions(cover_seam=True)
    designs = cover_seams(design_sheets(double_cone(0.04, 0.07, 0.04, 0.15, 0.15), options))
    assert [design.above for design in designs] == ["", "", "sheet 1", "sheet 2"]
    assert [design.name for design in designs] == [f"sheet {n}" for n in (1, 2, 3, 4)]
    partial = PlacedFrustum(Frustum(0.05, 0.05, 0.2, 4.0))
    mixed = cover_seams(design_sheets([partial, *double_cone(0.04, 0.07, 0.04, 0.15, 0.15)], options))
    assert [design.above for design in mixed] == ["", "", "", "sheet 2", "sheet 3"]
    with pytest.raises(GeometryError, match=r"no sheet has a seam to cover: the widest wraps 229 deg, .* at least 324"):
        cover_seams(design_sheets([partial], options))
    full = design_sheets([PlacedFrustum(Frustum(0.05, 0.05, 0.2))])
    assert cover_seams(full) == full, "nobody asked for it"


def test_a_strip_that_cannot_be_is_refused() -> None:
    thin = design_sheets(
        [PlacedFrustum(Frustum(0.012, 0.012, 0.2))], DesignOptions(plan=ElectrodePlan(), cover_seam=True)
    )
    with pytest.raises(GeometryError, match=r"sheet 1: a strip over its seam would have to wrap \d+ deg, at most 180"):
        cover_seams(thin)
    nearly = PlacedFrustum(Frustum(0.05, 0.05, 0.2, 5.8))  # tabs find room between its edges
    edge = design_sheets([nearly], DesignOptions(cover_seam=True, wires="edge0"))
    with pytest.raises(GeometryError, match="let them leave at an end"):
        cover_seams(edge)


def test_the_guide_places_a_strip_by_the_seam_below_it() -> None:
    options = DesignOptions(cover_seam=True)
    _, strip = cover_seams(design_sheets([PlacedFrustum(SHAPES["cylinder"])], options))
    text = "\n".join(sheet_lines(strip, measure_build(strip, 1), "sheet-2"))
    assert "| what it lies on | the outside of sheet 1 |" in text
    assert "It lies on the outside of sheet 1, over its seam" in text
    start = active_azimuths(
        replace(strip, layout=replace(strip.layout, active=replace(strip.layout.active, phi1=0.0))), Pose()
    )[0]
    back = -math.remainder(start, 2 * math.pi) * 0.060  # the outer face; the seam is at phi = 0
    assert f"| {1e3 * back:.1f} mm at end 1" in text


@pytest.mark.long
def test_a_scene_takes_both_sensors_without_suspicion(tmp_path: Path) -> None:
    from coneskin.scene.reader import parse_scene
    from coneskin.scene.suspicions import suspicions

    cs.design_link(SHAPES["cylinder"], tmp_path / "skin", options=cs.DesignOptions(cover_seam=True), pictures=False)
    files = "".join(f'[[link.sensor]]\nfile = "skin/sheet-{n}/sensor.toml"\n' for n in (1, 2))
    text = f'[[link]]\nname = "forearm"\n{files}[source]\nkind = "virtual"\n'
    scene = parse_scene(text, "scene.toml", tmp_path)
    assert [item.sensor.sensor_id for item in scene.links[0].sensors] == [0, 1]
    assert [one for one in suspicions(scene) if "lie over one another" in one.value] == []
