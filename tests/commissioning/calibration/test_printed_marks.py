"""Marks on the cover of a design: where they are drawn, and that a calibration asks for them."""

import json
import math
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.design.folder import write_design
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from tests.support.scenes import forearm_scene

TUBE = Frustum(0.0375, 0.0375, 0.24, math.radians(350))
Output = pytest.CaptureFixture[str]


def designed(cone: Frustum = TUBE, **options: object):
    return design_sheets([PlacedFrustum(cone, Pose())], DesignOptions(face_up="outside", **options))  # type: ignore[arg-type]


def test_crosses_lie_between_the_electrodes_at_ten_fifty_and_ninety_percent() -> None:
    (design,) = designed()
    cover, field = design.cuts[6], design.layout.field
    lines = [s.outline.bounds for s in cover.parts[0].strokes if s.kind == "score"]
    assert len(lines) == 18
    middles = {(round(0.5 * (x0 + x1), 6), round(0.5 * (y0 + y1), 6)) for x0, y0, x1, y1 in lines}
    # a tube unrolls to a rectangle: phi times the radius of the cover, from the middle
    radius = cover.surface.radius1
    places = {
        (
            round(radius * (field.phi1 + b * (field.phi2 - field.phi1) - 0.5 * TUBE.wrap), 6),
            round(field.u1 + a * (field.u2 - field.u1), 6),
        )
        for a in (0.1, 0.5, 0.9)
        for b in (0.1, 0.5, 0.9)
    }
    assert middles == places
    numbers = {label.text: label for label in cover.parts[0].labels if label.text.isdigit()}
    assert sorted(numbers) == list("123456789")
    for x, y in places:  # each number beside its cross
        assert min(math.hypot(x - label.x, y - label.y) for label in numbers.values()) < 0.008


@pytest.mark.long
def test_a_calibration_asks_for_the_printed_marks_of_its_design(tmp_path: Path, capsys: Output) -> None:
    data = write_design(tmp_path / "skin", designed(Frustum(0.03, 0.05, 0.15, 5.0)), pictures=False)
    marks = data["sheets"][0]["touch_marks"]
    assert json.loads((tmp_path / "skin" / "design.json").read_text())["sheets"][0]["touch_marks"] == marks
    text = forearm_scene()
    start, end = text.index("radius1_mm"), text.index("[source]")
    scene = tmp_path / "scene.toml"
    scene.write_text(f'{text[:start]}file = "skin/sensor.toml"\n\n{text[end:]}', encoding="utf-8")
    words = ["calibrate", str(scene), "--simulated", "--list", "--json"]
    assert main(words) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["u_mm"] for line in lines] == pytest.approx([mark["u_mm"] for mark in marks])
    assert [line["phi_deg"] for line in lines] == pytest.approx([mark["phi_deg"] for mark in marks])
    assert [line["where"].split(",")[0] for line in lines] == [f"at the cross with number {n}" for n in range(1, 10)]
    assert main([*words, "--marks", "4"]) == 0  # to be measured
    assert "cross" not in capsys.readouterr().out
    height = data["sheets"][0]["active_cone"]["height_mm"] - 3.0
    other = scene.read_text().replace('sensor.toml"', f'sensor.toml"\nheight_mm = {height}')
    scene.write_text(other, encoding="utf-8")  # no longer the sheet of that design
    assert main(words) == 0
    assert "cross" not in capsys.readouterr().out
    (tmp_path / "skin" / "design.json").write_text("[]")
    assert main(words) == 1
    assert "cannot be read" in capsys.readouterr().err
