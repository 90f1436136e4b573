"""Sheets of which rims and electrodes leave little: said with numbers, and the advice leaves as much as it says."""

import math
import re
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.sheets.summary import LEAST_ACTIVE_SHARE, small_active_area
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

_NUMBER = r"([\d.]+)"
_SENTENCE = (
    rf"only {_NUMBER}% of sheet 1 is active, {_NUMBER} of {_NUMBER} cm2: rims and electrodes leave {_NUMBER} of "
    rf"{_NUMBER} mm along and {_NUMBER} of {_NUMBER} deg around; --set electrodes.margin_mm={_NUMBER} "
    rf"--set electrodes.electrode_mm={_NUMBER} --set electrodes.lead_mm={_NUMBER} --set electrodes.hole_mm={_NUMBER} "
    rf"would leave {_NUMBER}%"
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
    share, active, whole, along, slant, around, wrap, margin, electrode, lead, hole, left = map(float, found.groups())
    assert whole == pytest.approx(1e4 * 2.0 * math.pi * 0.036 * 0.025, abs=0.05)
    assert (slant, wrap) == (25.0, 360.0)
    assert along == pytest.approx(25.0 - 2.0 * (6.0 + 6.0))  # two margins and two electrodes, of the paper's widths
    assert share == pytest.approx(100.0 * along / slant * around / wrap, abs=0.05)
    assert active == pytest.approx(0.01 * share * whole, abs=0.06)
    assert (margin, electrode, lead, hole) == (3.0, 3.0, 3.0, 0.0)  # half of them; a lead of 4 mm is no wider than one
    plan = ElectrodePlan(margin=1e-3 * margin, electrode=1e-3 * electrode, lead=1e-3 * lead, hole=1e-3 * hole)
    advised = design_of(0.036, 0.025, plan)
    assert advised.layout.active_share == pytest.approx(0.01 * left, abs=0.005)
    assert advised.layout.active_share > LEAST_ACTIVE_SHARE
    assert small_active_area(advised) == ""


def test_nothing_is_said_of_a_sheet_of_which_three_tenths_are_active():
    shares = {height: design_of(0.036, 1e-3 * height).layout.active_share for height in range(26, 45)}
    for height, share in shares.items():
        assert (small_active_area(design_of(0.036, 1e-3 * height)) == "") == (share >= 0.30)
    assert min(shares.values()) < 0.30 < max(shares.values())


@pytest.mark.long
def test_report_and_command_line_warn_alike(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    words = ["design", "--radius1-mm", "36", "--height-mm", "25", "--no-pictures"]
    assert main([*words, "-o", str(tmp_path / "a")]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "warning" in line]
    sentence = line.removeprefix("  warning: ")
    assert re.fullmatch(_SENTENCE, sentence)
    assert f"* **Warning: {sentence}**\n" in (tmp_path / "a" / "report.md").read_text()
    advised = sentence[sentence.index("--set") : sentence.index(" would leave")].split()
    assert main([*words, *advised, "-o", str(tmp_path / "b")]) == 0
    assert "warning" not in capsys.readouterr().out
    assert "Warning: only" not in (tmp_path / "b" / "report.md").read_text()
