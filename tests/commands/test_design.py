"""``coneskin design``, end to end: a folder that is whole or absent, a sensor file that loads, clear refusals."""

import csv
import json
import math
import shutil
import sys
import tomllib

import pytest

from coneskin.cli import main
from coneskin.commands import design as command
from coneskin.design import folder as design_folder

from .design_run import design, sensor_of, sets

CYLINDER = ["--radius1-mm", "54", "--height-mm", "200"]
BALL = ["--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150", "--radius3-mm", "40", "--height2-mm", "150"]
LAYERS = (
    "1-lower-substrate",
    "2-lower-electrodes",
    "3-lower-conductive",
    "4-isolation",
    "5-upper-conductive",
    "6-upper-electrodes",
    "7-upper-substrate",
    "all",
)


def test_a_cylinder_from_numbers_to_files(tmp_path, capsys):
    out = tmp_path / "new" / "skin"
    assert design(*CYLINDER, "-o", str(out)) == 0
    assert sorted(path.name for path in (out / "cut").iterdir()) == sorted(
        f"{layer}.{kind}" for layer in (*LAYERS, "0-test-piece") for kind in ("dxf", "svg", "pdf")
    )
    assert sorted(path.name for path in out.iterdir()) == [
        "cut",
        "design.json",
        "jig",
        "materials.csv",
        "nested",
        "report.md",
        "sensor.toml",
    ]
    assert sorted(path.name for path in out.parent.iterdir()) == ["skin"], "nothing is left beside it"
    text = capsys.readouterr()
    assert "sheet 1: radius 54.000 to 54.000 mm" in text.out
    assert "writing drawings" in text.err
    rows = list(csv.DictReader((out / "materials.csv").read_text().splitlines()))
    assert [row["layer"] for row in rows] == list(LAYERS[:-1])
    around = 2 * math.pi * 55.25  # the middle of the lower foam lies 1.25 mm above the link
    holes = 3 * math.pi * 1.0**2  # of the narrower widths, which leave more of this sheet active
    assert float(rows[0]["area_cm2"]) == pytest.approx((around * 200 - holes) / 100, abs=1e-4)


def test_sensor_file_loads_and_its_corners_are_the_inner_corners_of_the_electrodes(tmp_path):
    """phi = 0, end 1 of the loaded frustum is where B meets D, at the height of the upper conductive layer."""
    assert design(*BALL, "--wrap-deg", "300", "-o", str(tmp_path / "out")) == 0
    data = json.loads((tmp_path / "out" / "design.json").read_text())
    for index, sheet in enumerate(data["sheets"]):
        sensor, placed = sensor_of(tmp_path / "out" / f"sheet-{index + 1}")
        assert sensor.sensor_id == index
        assert sensor.b_positive
        assert sensor.c_positive
        cone, patch = sheet["link_cone"], sheet["field_patch"]
        half_angle = math.radians(cone["half_angle_deg"])
        height = 3.45  # 2.5 + 0.1 + 0.8 mm and the middle of 0.1
        for u_mm, u in ((patch["u1_mm"], 0.0), (patch["u2_mm"], placed.frustum.slant)):
            for phi_deg, phi in ((patch["phi1_deg"], 0.0), (patch["phi2_deg"], placed.frustum.wrap)):
                rho = cone["radius1_mm"] + u_mm * math.sin(half_angle) + height * math.cos(half_angle)
                z = cone["xyz_mm"][2] + u_mm * math.cos(half_angle) - height * math.sin(half_angle)
                turn = math.radians(phi_deg)
                want = (rho * math.cos(turn), rho * math.sin(turn), z)
                assert [1e3 * x for x in placed.point(u, phi)] == pytest.approx(want, abs=1e-3)  # json has 4 digits


@pytest.mark.long
def test_two_sheets_of_a_rugby_ball_keep_the_gap_and_lead_their_wires_away(tmp_path, capsys):
    assert design(*BALL, *sets("sheet.sheet_gap_mm=2"), "--json", "-o", str(tmp_path / "out")) == 0
    data = json.loads(capsys.readouterr().out)
    first, second = data["sheets"]
    end = first["link_cone"]["xyz_mm"][2] + first["link_cone"]["height_mm"]
    alpha = math.atan2(30, 150)  # 2 mm along the slant, from rim to rim
    assert second["link_cone"]["xyz_mm"][2] - end == pytest.approx(2.0 / math.cos(alpha), rel=0.05)
    assert first["gaps_mm"] == {"sheet 2": pytest.approx(2.0, abs=2e-3)}
    report = (tmp_path / "out" / "report.md").read_text()
    assert "| tabs | over end 1 |" in report
    assert "| tabs | over end 2 |" in report


@pytest.mark.long
def test_two_sheets_of_a_waist_are_trimmed_until_their_outer_faces_clear(tmp_path):
    waist = [
        "--radius1-mm",
        "70",
        "--radius2-mm",
        "50",
        "--height-mm",
        "150",
        "--radius3-mm",
        "70",
        "--height2-mm",
        "150",
    ]
    assert design(*waist, *sets("sheet.sheet_gap_mm=1"), "-o", str(tmp_path / "out")) == 0
    data = json.loads((tmp_path / "out" / "design.json").read_text())
    assert data["sheets"][0]["gaps_mm"]["sheet 2"] == pytest.approx(1.0, abs=2e-3)
    one, two = (sheet["link_cone"] for sheet in data["sheets"])
    outer = 6.0 * math.sin(math.atan2(20, 150))  # an outer face is shifted so far towards the waist
    apart = two["xyz_mm"][2] - one["xyz_mm"][2] - one["height_mm"]
    assert apart - 2.0 * outer == pytest.approx(1.0, abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize(("wrap_deg", "gap_mm"), [(360.0, 1.5), (359.9, 1.5), (350.0, 9.4248), (300.0, 56.5487)])
def test_a_seam_gap_opens_to_what_was_asked(tmp_path, wrap_deg: float, gap_mm: float) -> None:
    """A search finds wraps of nearly a turn. One that leaves more than the gap stays as it is."""
    words = [*CYLINDER, "--wrap-deg", str(wrap_deg), *sets("sheet.seam_gap_mm=1.5"), "-o", str(tmp_path / "out")]
    assert design(*words) == 0
    cone = json.loads((tmp_path / "out" / "design.json").read_text())["sheets"][0]["link_cone"]
    assert math.radians(360.0 - cone["wrap_deg"]) * 54.0 == pytest.approx(gap_mm, abs=1e-4)
    assert cone["rpy_deg"][2] == pytest.approx((wrap_deg - cone["wrap_deg"]) / 2, abs=1e-4)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--height-mm", "100"], "name a mesh file, or give --radius1-mm and --height-mm"),
        ([*CYLINDER, "--wrap-deg", "361"], "--wrap-deg must be above 0 to 360 deg, got 361.0"),
        ([*CYLINDER, "--wrap-deg", "nan"], "--wrap-deg must be above 0 to 360 deg, got nan"),
        ([*CYLINDER, "--radius1-mm", "-5"], "--radius1-mm must be 0 or from 1 to 5000 mm, got -5.0 mm"),
        ([*CYLINDER, "--radius1-mm", "nan"], "--radius1-mm must be 0 or from 1 to 5000 mm, got nan mm"),
        ([*CYLINDER, "--radius1-mm", "1e300"], "--radius1-mm must be 0 or from 1 to 5000 mm, got 1e+300 mm"),
        ([*CYLINDER, "--radius1-mm", "0.054"], "got 0.054 mm: is that in metres? Then write 54"),
        ([*CYLINDER, "--height-mm", "0.2"], "got 0.2 mm: is that in metres? Then write 200"),
        ([*CYLINDER, "--radius2-mm", "0"], "sheet 1: a sheet cannot reach an apex"),
        ([*CYLINDER, "--height-mm", "0"], "height must be above 0 where both radii are equal"),
        ([*CYLINDER, "--radius3-mm", "30"], "a second cone needs both --radius3-mm and --height2-mm"),
        (["nowhere.stl"], "nowhere.stl"),
        (
            [*CYLINDER, "--tolerance-mm", "1"],
            "--tolerance-mm is for a mesh, in which sheets are searched: leave it out",
        ),
        ([*CYLINDER, "--seam", "0", "0", "0"], "--seam is for a mesh: by its dimensions a link has no directions"),
        (["nowhere.stl", "--radius1-mm", "5"], "a mesh and --radius1-mm cannot go together"),
    ],
)
def test_a_mistake_is_one_clear_line_and_leaves_nothing(words, line, tmp_path, capsys):
    assert design(*words, "-o", str(tmp_path / "out")) == 1
    errors = [row for row in capsys.readouterr().err.splitlines() if row.startswith("coneskin design:")]
    assert len(errors) == 1
    assert line in errors[0]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "settings", "line"),
    [
        (CYLINDER, "electrodes.margin_mm=150", "the sheet measures 200 mm from end to end; margins of 150 mm"),
        (
            CYLINDER,
            "electrodes.margin_mm=94",
            "of 94 mm and electrodes of 6 mm on both sides leave less than 1 mm active",
        ),
        (
            CYLINDER,
            "layers.thickness_mm=[1, 1, 0, 1, 1]",
            "thickness_mm[2] must be above 0 to 20 mm, got 0.0 mm",
        ),
        (
            CYLINDER,
            "layers.neutral_factor=[0, 0, 2, 0, 0]",
            "neutral_factor[2] must be from 0 to 1, got 2",
        ),
        (CYLINDER, "drawings.kerf_mm=-1", "kerf_mm must be at least 0 mm, got -1.0 mm"),
        (CYLINDER, "drawings.kerf_mm=20", "is larger than a detail"),
        (CYLINDER, "sheet.seam_gap_mm=-1", "seam_gap_mm must be at least 0 mm, got -1.0 mm"),
        (CYLINDER, "sheet.seam_gap_mm=400", "seam gap of 400 mm takes the whole narrow end, 339.3 mm"),
        (CYLINDER, "sheet.sheet_gap_mm=inf", "sheet_gap_mm must be at least 0 mm, got inf mm"),
        (BALL, "sheet.sheet_gap_mm=400", "the gap to its neighbors takes"),
        (
            CYLINDER,
            "drawings.tolerance_mm=0",
            "tolerance_mm must be from 0.0001 to 1 mm, got 0.0 mm",
        ),
        (CYLINDER, "drawings.arcs=flattened; drawings.tolerance_mm=1e-9", "from 0.0001 to 1 mm, got 1e-09 mm"),
        (CYLINDER, "drawings.tolerance_mm=nan", "from 0.0001 to 1 mm, got nan mm"),
        ([*CYLINDER, "--wrap-deg", "300"], "sheet.overlap_mm=5", "an overlap closes the seam of a full wrap"),
        (CYLINDER, "sheet.overlap_mm=400", "an overlap must be at most 25% of the narrow end, 84.82 mm, got 400 mm"),
        (
            CYLINDER,
            "layers.thickness_mm=[100, 1, 1, 1, 1]",
            "thickness_mm[0] must be above 0 to 20 mm, got 100.0 mm",
        ),
        ([*CYLINDER, "--radius1-mm", "10"], "layers.thickness_mm=[20, 1, 1, 1, 1]", "is strained by -50% at the"),
        (CYLINDER, "electronics.adc_bits=0", "adc_bits must be a whole number from 8 to 16, got 0"),
        (CYLINDER, "electronics.adc_bits=20", "adc_bits must be a whole number from 8 to 16, got 20"),
        (
            CYLINDER,
            "electronics.upper_sheet_ohm=1; electronics.current_full_scale_ma=20",
            "current_full_scale_ma must suit the normal drive current",
        ),
        (CYLINDER, "electronics.supply_v=3.3", "supply_v must be at most 95 % of adc_v"),
        (CYLINDER, "sheet.overlap_mm=5; sheet.wires=edge1", "an overlap would cover the tabs at edge1"),
        (CYLINDER, "search.touch_side=[1, 0, 0]", "search.touch_side is for a mesh"),
        (
            [*CYLINDER, "--wrap-deg", "180"],
            "sheet.cover_seam=true",
            "no sheet has a seam to cover: the widest wraps 180 deg",
        ),
        (
            CYLINDER,
            "drawings.bed_mm=[1e-9, 1e-9]",
            "bed_mm[0] must be from 50 to 10000 mm, got 1e-09 mm",
        ),
        (CYLINDER, "drawings.bed_mm=[600, nan]", "bed_mm[1] must be from 50 to 10000 mm, got nan mm"),
        (CYLINDER, "electrodes.tab_mm=nan", "tab_mm must be at least 0 mm, got nan mm"),
        (CYLINDER, "kerf_mm=0.2", "write TABLE.KEY=VALUE, as in --set drawings.kerf_mm=0.2; got --set kerf_mm=0.2"),
        (CYLINDER, "drawing.kerf_mm=0.2", "--set drawing: unknown table; did you mean drawings?"),
        (CYLINDER, "drawings.kerf=0.2", "--set drawings: unknown key kerf; did you mean kerf_mm?"),
        (CYLINDER, "drawings.page=A5", "page must be one of A4, A3, Letter, got 'A5'"),
        (CYLINDER, "drawings.kerf_mm=wide", "kerf_mm must be a number [mm], got 'wide'"),
    ],
)
def test_a_wrong_setting_is_one_clear_line_and_leaves_nothing(words, settings, line, tmp_path, capsys):
    assert design(*words, *sets(*settings.split("; ")), "-o", str(tmp_path / "out")) == 1
    (error,) = (row for row in capsys.readouterr().err.splitlines() if row.startswith("coneskin design:"))
    assert line in error
    assert list(tmp_path.iterdir()) == []


def test_a_failure_halfway_leaves_nothing(tmp_path, monkeypatch, capsys):
    """Power, disk, a bug: after the first files are written."""
    written = []

    def breaks(sheets, *_):
        written.append(len(list(tmp_path.rglob("*.dxf"))))
        if len(written) == 3:
            raise OSError(28, "No space left on device")
        return "drawing"

    monkeypatch.setattr(design_folder, "to_dxf", breaks)
    assert design(*CYLINDER, "-o", str(tmp_path / "out")) == 1
    assert "coneskin design: No space left on device" in capsys.readouterr().err
    assert written == [0, 1, 2], "files were there when it failed"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_folder_is_replaced_only_by_force_and_only_if_it_is_a_design(tmp_path, capsys, cylinder_design):
    out = tmp_path / "out"
    shutil.copytree(cylinder_design, out)
    before = (out / "sensor.toml").read_text()
    assert design(*CYLINDER, *sets("electrodes.margin_mm=8"), "-o", str(out)) == 1
    assert "exists already: choose another folder, or replace the design there (--force" in capsys.readouterr().err
    assert (out / "sensor.toml").read_text() == before
    (out / "old.txt").write_text("old")
    assert design(*CYLINDER, *sets("electrodes.margin_mm=8"), "--force", "-o", str(out)) == 0
    assert (out / "sensor.toml").read_text() != before
    assert (out / "old.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    precious = tmp_path / "precious"
    precious.mkdir()
    (precious / "thesis.tex").write_text("years of work")
    assert design(*CYLINDER, "--force", "-o", str(precious)) == 1
    assert "is not a design (no design.json in it), so it is not replaced" in capsys.readouterr().err
    assert (precious / "thesis.tex").read_text() == "years of work"
    empty = tmp_path / "empty"
    empty.mkdir()
    assert design(*CYLINDER, "-o", str(empty)) == 0


def test_a_folder_that_is_there_is_refused_before_any_work(tmp_path, monkeypatch, capsys):
    """Reading and fitting a mesh takes seconds; the folder is known before."""
    (tmp_path / "thesis.tex").write_text("years of work")
    assert design("nowhere.stl", "-o", str(tmp_path)) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "exists already" in line
    assert design("nowhere.stl", "--force", "-o", str(tmp_path)) == 1
    assert "is not a design" in capsys.readouterr().err


@pytest.mark.parametrize("height", ["60", *(pytest.param(mm, marks=pytest.mark.long) for mm in ("40", "4000"))])
@pytest.mark.long
def test_no_geometry_is_refused_for_its_electronics(height, tmp_path):
    words = ["--radius1-mm", "54", "--height-mm", height, "--no-pictures", "-o", str(tmp_path / "out")]
    assert design(*words) == 0
    sensor, _ = sensor_of(tmp_path / "out")
    report = (tmp_path / "out" / "report.md").read_text()
    assert f"| full scale of the current | {1e3 * sensor.electronics.current_full_scale:.3f} mA |" in report
    assert f"| pull-downs of C and D | {sensor.electronics.pulldown_ohms / 1e3:g} kohm |" in report


def test_missing_packages_are_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    assert design(*CYLINDER, "-o", str(tmp_path / "out")) == 1
    assert "writing DXF files needs the package ezdxf: pip install 'coneskin[design]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_numbers_of_the_report_are_those_of_the_drawings(tmp_path):
    words = [*CYLINDER, *sets("layers.assembly=bonded", "layers.material=['a', 'b', 'c', 'd', 'e']")]
    words += sets("electronics.adc_bits=10", "electronics.supply_v=3.0", "electronics.current_full_scale_ma=30")
    words += sets("electronics.upper_sheet_ohm=500", "electronics.lower_sheet_ohm=2000")
    assert design(*words, "-o", str(tmp_path / "out")) == 0
    report = (tmp_path / "out" / "report.md").read_text()
    assert "Assembly: bonded" in report
    assert "rectangle 358.142 x 200.000 mm" in report  # 2 pi (54 + 3)
    assert "One count of 10 bits over 3.3 V at a supply of 3 V" in report
    assert "| full scale of the current | 30.000 mA |" in report
    assert "sheet 1,4-isolation,c 0.80 mm," in (tmp_path / "out" / "materials.csv").read_text()
    sensor, _ = sensor_of(tmp_path / "out")
    assert (sensor.upper_sheet_ohms, sensor.lower_sheet_ohms) == (500.0, 2000.0)
    assert sensor.electronics.current_full_scale == pytest.approx(0.03)
    assert sensor.electronics.adc_bits == 10
    assert sensor.electronics.supply_volts == 3.0


def test_sensor_file_holds_every_digit_of_the_shape_and_a_pose_to_read(tmp_path):
    assert design(*CYLINDER, "-o", str(tmp_path / "out")) == 0
    table = tomllib.loads((tmp_path / "out" / "sensor.toml").read_text())
    assert table["radius1_mm"] == table["radius2_mm"] == pytest.approx(54 + 3.45, rel=1e-14)
    assert table["height_mm"] == pytest.approx(200 - 18, rel=1e-13)
    assert table["wrap_deg"] == pytest.approx(360 - 2 * math.degrees(9 / 54), rel=1e-13)
    assert table["xyz_mm"] == [0.0, 0.0, 9.0]
    assert table["rpy_deg"] == [0.0, 0.0, round(math.degrees(9 / 54), 4)]


@pytest.mark.long
@pytest.mark.parametrize(
    "words",
    [
        [
            "--radius1-mm",
            "60",
            "--radius2-mm",
            "160",
            "--height-mm",
            "0",
            "--set",
            "electronics.current_full_scale_ma=50",
        ],
        ["--radius1-mm", "50", "--radius2-mm", "150", "--height-mm", "85", *sets("sheet.wires=end2")],
        [*BALL[:6], "--wrap-deg", "200", *sets("sheet.wires=edge1")],
    ],
)
def test_pictures_of_discs_wide_sectors_and_partial_wraps(words, tmp_path):
    assert main(["design", *words, "-o", str(tmp_path / "out")]) == 0
    for path in (tmp_path / "out" / "pictures").iterdir():
        assert path.stat().st_size > 10_000
    assert (tmp_path / "out" / "pictures" / "link.png").is_file()


@pytest.mark.long
def test_help_shows_examples_that_run(tmp_path, monkeypatch):
    """Every example of --help that needs no mesh."""
    monkeypatch.chdir(tmp_path)
    lines = [row.strip().split("    ")[0] for row in str(command.__doc__).splitlines() if "--radius1-mm" in row]
    assert len(lines) == 3
    for i, row in enumerate(lines):
        words = row.split()[2:]
        words[words.index("skin")] = f"skin{i}"
        assert design(*words) == 0
        assert (tmp_path / f"skin{i}" / "report.md").is_file()


def test_a_file_of_options_is_written_changed_and_used(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["design", "--write-options", "design.toml"])
    assert ended.value.code == 0
    assert "design.toml written: change it, then coneskin design LINK" in capsys.readouterr().err
    text = (tmp_path / "design.toml").read_text().replace("#kerf_mm = 0", "kerf_mm = 0.4").replace("#tab_mm", "tab_mm")
    (tmp_path / "design.toml").write_text(text)
    words = ["-o", "out", "--options", "design.toml", *sets("electrodes.margin_mm=8")]
    assert design(*CYLINDER, *words) == 0
    report = (tmp_path / "out" / "report.md").read_text()
    assert "These files have 0.4 mm in their outlines" in report
    table = tomllib.loads((tmp_path / "out" / "sensor.toml").read_text())
    assert table["height_mm"] == pytest.approx(200 - 28)  # margins of 8 mm, electrodes of 6 mm


def test_a_file_of_options_is_not_overwritten(tmp_path, capsys):
    (tmp_path / "design.toml").write_text("mine")
    with pytest.raises(SystemExit) as ended:
        main(["design", "--write-options", str(tmp_path / "design.toml")])
    assert ended.value.code == 2
    assert "design.toml exists already: choose another name" in capsys.readouterr().err
    assert (tmp_path / "design.toml").read_text() == "mine"


def test_a_mistake_in_a_file_of_options_names_the_file_and_the_key(tmp_path, capsys):
    path = tmp_path / "design.toml"
    path.write_text("[drawings]\nkerf_mm = -1\n")
    assert design(*CYLINDER, "--options", str(path), "-o", str(tmp_path / "out")) == 1
    error = capsys.readouterr().err
    assert f"coneskin design: {path}: 1 mistake\n  drawings.kerf_mm must be at least 0 mm, got -1.0 mm" in error
    assert list(tmp_path.iterdir()) == [path]
