"""``design.toml``: every key has the name, the default and the limits of a field, and a mistake is told by its key."""

import math
import re
from dataclasses import fields
from pathlib import Path

import pytest

from coneskin.core.errors import GeometryError, SceneError
from coneskin.design.design_toml import DESIGN_TABLES, read_settings, settings_text
from coneskin.design.folder import FileOptions
from coneskin.design.sheets.sheet_design import DesignOptions, JigPlan
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.fit.fit_options import FitOptions

KEYS = {f"{table}.{key.name}": key for table, (_, keys) in DESIGN_TABLES.items() for key in keys}


#: limits and default of each number, as a person sees them
NUMBERS = """
search.tolerance_mm: above 0 to 20, 1
search.max_sheets: 1 to 100, 2
search.max_wires: 4 to 400, any number
search.min_length_mm: above 0, 25
search.min_wrap_deg: above 0 to 360, 150
search.max_bridge_mm: above 0 to 100, 10
layers.thickness_mm: above 0 to 20, [2.5, 0.1, 0.8, 0.1, 2.5]
layers.neutral_factor: 0 to 1, [0.5, 0.5, 0.5, 0.5, 0.5]
layers.stiffness_mpa: above 0, [0.3, 1000, 20, 1000, 0.3]
electrodes.margin_mm: at least 0, 6
electrodes.electrode_mm: at least 0, 6
electrodes.setback_mm: at least 0, 1
electrodes.lead_mm: at least 0, 4
electrodes.clearance_mm: at least 0, 1.5
electrodes.tab_mm: at least 0, 12
electrodes.hole_mm: at least 0, 2.5
sheet.connector_mm: 30 to 2000, 60
sheet.seam_gap_mm: at least 0, 0
sheet.overlap_mm: at least 0, 0
sheet.sheet_gap_mm: at least 0, 1
drawings.kerf_mm: at least 0, 0
drawings.tolerance_mm: 0.0001 to 1, 0.01
drawings.bed_mm: 50 to 10000, [600, 400]
drawings.bed_gap_mm: 0 to 100, 3
jig.wall_mm: 1.5 to 20, 3
jig.clearance_mm: 0 to 3, 0.3
jig.reach_mm: 8 to 200, 20
jig.grip_mm: 4 to 100, 15
jig.parts: 2 to 8, 2
electronics.supply_v: 0.1 to 50, matches the sheets
electronics.adc_v: 0.1 to 50, 3.3
electronics.adc_bits: 8 to 16, matches the sheets
electronics.pulldown_ohm: 1 to 1e+09, matches the sheets
electronics.current_full_scale_ma: 0.001 to 10000, matches the sheets
electronics.upper_sheet_ohm: 0.001 to 1e+09, chosen to match the sheet
electronics.lower_sheet_ohm: 0.001 to 1e+09, chosen to match the sheet
"""


def test_each_number_has_its_limits_and_its_default() -> None:
    found = [
        f"{name}: {key.bounds}, {key.default_words}" for name, key in KEYS.items() if key.kind in (float, int, list)
    ]
    assert [line for line in found if not re.search(r": , ", line)] == NUMBERS.strip().splitlines()


def written(folder: Path, text: str) -> Path:
    path = folder / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_file_as_it_is_written_changes_nothing(tmp_path: Path) -> None:
    settings = read_settings(written(tmp_path, settings_text()))
    assert (settings.options, settings.files, settings.search) == (DesignOptions(), FileOptions(), {})


def test_every_value_in_the_file_is_the_default_of_its_field(tmp_path: Path) -> None:
    text = re.sub(r"^#(?=\w+ = .)", "", settings_text(), flags=re.MULTILINE)
    settings = read_settings(written(tmp_path, text))
    assert (settings.options, settings.files) == (DesignOptions(plan=ElectrodePlan()), FileOptions())
    assert read_settings().options.plan is None, "without its table it is chosen for each sheet"
    search = dict(settings.search)
    assert search.pop("round_only") is False
    assert FitOptions(**search) == FitOptions()
    assert len(search) == 7, "tolerance, number, length, wrap, bridge, hull, exposure"


def test_every_key_stands_in_the_file_with_its_meaning_and_its_unit() -> None:
    text = settings_text()
    for name, key in KEYS.items():
        meaning = re.escape(key.meaning[0].upper() + key.meaning[1:])
        line = re.search(rf"^# {meaning}(.*)\n#{key.name} =", text, re.MULTILINE)
        assert line is not None, name
        if key.suffix:
            assert f" [{key.unit}]." in line[1], name


def test_every_option_in_python_has_a_key() -> None:
    plain = {key.plain for key in KEYS.values()}
    composed = {"stack", "plan", "electronics", "jig", "snap", "link", "upper_sheet_ohms", "lower_sheet_ohms"}
    for owner, others in (
        (DesignOptions, composed),
        (ElectrodePlan, {"wires"}),
        (JigPlan, set()),
        (FileOptions, {"tolerance"}),
        (FitOptions, {"wrap", "samples", "seam_direction", "min_radius", "min_arc", "thickness", "gap"}),
    ):
        assert {field.name for field in fields(owner)} - plain == others - plain, owner.__name__


@pytest.mark.parametrize(
    ("name", "key"), [(name, key) for name, key in KEYS.items() if key.kind in (float, int) and name[:5] != "elect"]
)
def test_what_a_key_allows_its_field_takes(name: str, key: object) -> None:
    for limit in (key.low, key.high):  # type: ignore[attr-defined]
        if math.isfinite(limit):
            limit += 1e-9 if key.above and limit == key.low else 0  # type: ignore[attr-defined]
            settings = read_settings(words=[f"{name}={limit!r}"])
            FitOptions(**{k: v for k, v in settings.search.items() if k != "round_only"})


def test_a_setting_on_the_command_line_goes_before_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, "[drawings]\nkerf_mm = 0.2\npage = 'A3'\n[layers]\nthickness_mm = [3, 0.2, 1, 0.2, 4]\n")
    settings = read_settings(path, ["drawings.kerf_mm=0.3", "layers.assembly=pairs"])
    assert settings.options.kerf == pytest.approx(0.3e-3)
    assert settings.files.page == "A3"
    assert [1e3 * layer.thickness for layer in settings.options.stack.layers] == pytest.approx([3, 0.2, 1, 0.2, 4])
    assert settings.options.stack.assembly == "pairs"


def test_mistakes_in_a_file_are_told_all_at_once(tmp_path: Path) -> None:
    text = """
kerf_mm = 0.2
[drawing]
[drawings]
kerf = 0.2
page = "A5"
[layers]
thickness_mm = [2.5, 0.1]
material = "foam"
[electrodes]
margin_mm = "wide"
[jig]
wall_mm = 0.003
"""
    with pytest.raises(SceneError) as caught:
        read_settings(written(tmp_path, text))
    assert caught.value.problems == (
        "kerf_mm: unknown table; the key kerf_mm belongs into the table drawings",
        "drawing: unknown table; did you mean drawings?",
        "drawings: unknown key kerf; did you mean kerf_mm?",
        "drawings.page must be one of A4, A3, Letter, got 'A5'",
        "layers.thickness_mm must be a list of 5 numbers, got [2.5, 0.1]",
        "layers.material must be a list of 5 texts, got 'foam'",
        "electrodes.margin_mm must be a number [mm], got 'wide'",
        "jig.wall_mm must be from 1.5 to 20 mm, got 0.003 mm: is that in metres? Then write 3",
    )
    assert str(caught.value).startswith(f"{tmp_path / 'design.toml'}: 8 mistakes\n")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[drawings", "design.toml is not TOML"),
        ("[search]\nweights = 'gone.csv'", "gone.csv"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_cannot_be_read_is_named(text: str | None, line: str, tmp_path: Path) -> None:
    path = tmp_path / "design.toml" if text is None else written(tmp_path, text)
    with pytest.raises((GeometryError, SceneError), match=line):
        read_settings(path)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["search.seam=[0, 0, 0]"], "search.seam must be a direction"),
        (
            ["search.seam=[0, 0, 1]", "search.touch_side=[1, 0, 0]"],
            "search.touch_side cannot go together",
        ),
        (["search.weights=map.csv", "search.exposure=true"], "search.weights and search.exposure cannot go together"),
    ],
)
def test_what_cannot_go_together_is_refused(words: list[str], line: str) -> None:
    with pytest.raises(GeometryError, match=line):
        read_settings(words=words)


def test_the_seam_faces_away_from_the_side_of_touches() -> None:
    assert read_settings(words=["search.touch_side=[0, 1, -2]"]).search == {"seam_direction": (0.0, -1.0, 2.0)}
