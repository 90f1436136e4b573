"""Sheets of which rims and electrodes leave little, and links that sheets cover in part: said as they are built."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from coneskin.cli import main
from coneskin.design.link_design import as_built, design_link
from coneskin.design.report import report_text
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.sheets.summary import small_active_area
from coneskin.design.workshop.build_figures import measure_build
from coneskin.geometry.drawing.electrode_layout import LEAST_ACTIVE_SHARE, ElectrodePlan, best_layout
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from tests.geometry.synthetic import placed, revolve

_NUMBER = r"([\d.]+)"
_SENTENCE = (
    rf"only {_NUMBER}% of sheet 1 is active, {_NUMBER} of {_NUMBER} cm2: rims and electrodes leave {_NUMBER} of "
    rf"{_NUMBER} mm along and {_NUMBER} of {_NUMBER} deg around; without a table of electrodes their widths are "
    rf"chosen, and leave {_NUMBER}%"
)


def design_of(radius: float, height: float, plan: ElectrodePlan | None = None):
    (design,) = design_sheets(
        [PlacedFrustum(Frustum(radius, radius, height))], DesignOptions(plan=plan or ElectrodePlan())
    )
    return design


def test_what_is_advised_for_a_short_sheet_leaves_what_is_said():
    design = design_of(0.036, 0.025)
    found = re.fullmatch(_SENTENCE, small_active_area(design))
    assert found is not None
    share, active, whole, along, slant, around, wrap, left = map(float, found.groups())
    assert whole == pytest.approx(1e4 * 2.0 * math.pi * 0.036 * 0.025, abs=0.05)
    assert (slant, wrap) == (25.0, 360.0)
    assert along == pytest.approx(25.0 - 2.0 * (6.0 + 6.0))  # two margins and two electrodes, of the paper's widths
    assert share == pytest.approx(100.0 * along / slant * around / wrap, abs=0.05)
    assert active == pytest.approx(0.01 * share * whole, abs=0.06)
    chosen = best_layout(design.layout.sheet).active_share
    assert chosen == pytest.approx(0.01 * left, abs=0.005)
    assert chosen > LEAST_ACTIVE_SHARE


@pytest.mark.long
def test_nothing_is_said_of_a_sheet_of_which_enough_is_active():
    shares = {height: design_of(0.036, 1e-3 * height).layout.active_share for height in range(26, 60)}
    for height, share in shares.items():
        assert (small_active_area(design_of(0.036, 1e-3 * height)) == "") == (share >= LEAST_ACTIVE_SHARE)
    assert min(shares.values()) < LEAST_ACTIVE_SHARE < max(shares.values())


@pytest.mark.long
def test_report_and_command_line_warn_alike(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    words = ["design", "--radius1-mm", "36", "--height-mm", "25", "--no-pictures"]
    assert main([*words, "-o", str(tmp_path / "chosen")]) == 0
    assert "warning" not in capsys.readouterr().out, "widths that are chosen leave enough"
    words += ["--set", "electrodes.margin_mm=6"]
    assert main([*words, "-o", str(tmp_path / "a")]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "warning" in line]
    sentence = line.removeprefix("  warning: ")
    assert re.fullmatch(_SENTENCE, sentence)
    assert f"* **Warning: {sentence}**\n" in (tmp_path / "a" / "report.md").read_text()


@pytest.mark.parametrize(("slant", "least"), [(0.02, 0.40), (0.04, 0.60), (0.2, 0.80)])
def test_widths_that_are_chosen_leave_most_active_but_for_the_holes(slant: float, least: float):
    chosen = best_layout(Frustum(0.04, 0.04, slant, 4.0))
    assert chosen.active_share >= least
    assert bool(chosen.holes) == (slant == 0.2), "holes cost a tenth of the active area at most"
    given = ElectrodePlan(margin=3e-3, electrode=3e-3, lead=3e-3, hole=0.0)
    assert best_layout(chosen.sheet, given, "end2").plan == replace(given, wires="end2")


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        (1.0, r"44% of the hull of the link\n(?!\* No sheet)"),
        (0.75, r"33% of the hull .*\n\* No sheet on 11% .*: no room"),
    ],
)
def test_the_report_tells_what_is_covered_as_built(kept: float, words: str) -> None:
    """A fit of 44 % of a link's hull, of which a sheet may have to leave a quarter to another or to wires."""
    place = PlacedFrustum(Frustum(0.05, 0.05, 0.2))
    fitted = FittedSheet(place, 0.0, 0.0, 0.0, 0.0, 1.0, 0.44, 0.0)
    fit = LinkFit((fitted,), None, 1e-3, 0.2, 0.1, (), "", 1)
    (built,) = design_sheets([place.part(0.0, kept * 0.2, 0.0, math.tau)], DesignOptions())
    design = replace(built, found=fitted)
    fit = as_built(fit, (design,))
    assert re.search(words, report_text((design,), [measure_build(design, 0)], "tube", fit=fit))
    # what is left is where the sheet ends early
    assert all(0.15 <= z <= 0.2 for area in fit.bare_areas for z in area.points[:, 2])


@pytest.mark.long
def test_each_sheet_and_all_together_tell_the_share_of_the_link_as_built(tmp_path: Path) -> None:
    """Against points of the mesh under the sheets: open seams and wires at end 2 take of each as much as they do."""
    mesh = placed(revolve([(0.0, 0.03), (0.1, 0.06), (0.2, 0.06)]))
    options = DesignOptions(seam_gap=0.03, wires="end2")
    design = design_link(mesh, tmp_path / "out", options=options, pictures=False)
    points, _ = trimesh.sample.sample_surface(trimesh.Trimesh(mesh.vertices, mesh.faces), 100_000, seed=1)
    report, told = (tmp_path / "out" / "report.md").read_text(), []
    for sheet, data in zip(design.sheets, design.data["sheets"], strict=True):
        u, phi, off = sheet.place.locate_all(points)
        side = sheet.place.frustum
        under = (np.abs(off) <= 1.5e-3) & (u >= 0.0) & (u <= side.slant) & (phi >= 0.0) & (phi <= side.wrap)
        told.append(data["fit"]["area_share"])
        assert told[-1] == pytest.approx(float(under.mean()), abs=0.01)
        assert told[-1] == data["fit"]["touch_share"]
        assert f" of its length, {told[-1]:.0%} of its hull |" in report
    assert len(told) == 2
    assert design.fit is not None
    assert sum(sheet.area_share for sheet in design.fit.sheets) == pytest.approx(sum(told), abs=1e-4)
    assert f" {sum(told):.0%} of the hull of the link\n" in report
    bare = sum(area["share"] for area in design.data["bare_areas"])
    assert sum(told) + bare == pytest.approx(1.0, abs=5e-3)  # less than that is not told
