"""The table [speed_limit]: it comes from a file, holds for one scene, and travels with a recording."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w

from coneskin.errors import SceneError
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.guard.phase import Phase
from coneskin.scene.build import _speed_limit, build_core, place_on_arm
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.scene import Scene
from coneskin.scene.speed_limit import LimitedPatch, SpeedLimitScene
from coneskin.scene.tables.speed_limit_table import limit_fingerprint
from coneskin.testing.forearm import forearm_scene

SCENE = forearm_scene() + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n"
LIMITED = SCENE.replace('model = "UR5e"', 'model = "UR5e"\nspeed_limit_from = "impact.toml"')
NAME = parse_scene(SCENE).sensors[0].sensor.name


def table(**changes: object) -> dict[str, object]:
    values: dict[str, object] = {
        "format": 1,
        "fingerprint": limit_fingerprint(parse_scene(SCENE)),
        "date": "2026-11-23T06:00:00Z",
        "coneskin": "0.1.0",
        "edition": "invented",
        "transcribed_by": "one",
        "verified_by": "other",
        "measured_by": "a test",
        "reaction_ms": 10.0,
        "deceleration_rad_s2": 9.0,
        "curves": 1,
        "patches": 8,
        "levers_mm": [100.0, 200.0, 400.0],
        "curve": [{"region": "hand", "speeds_mm_s": [50.0, 100.0, 200.0]}],
        "patch": [
            {"sensor": NAME, "u_mm": u, "phi_deg": phi, "curve": 0, "any_curve": 0}
            for u in (0.0, 260.0)
            for phi in (0.0, 90.0, 180.0, 270.0)
        ],
    }
    return {"speed_limit": values | changes}


def load(folder: Path, text: str = LIMITED, **changes: object) -> Scene:
    (folder / "impact.toml").write_text(tomli_w.dumps(table(**changes)), encoding="utf-8")
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return load_scene(folder / "scene.toml")


def test_a_scene_takes_the_speeds_from_the_file_and_its_guard_needs_the_slider(tmp_path: Path) -> None:
    scene = load(tmp_path)
    assert scene.speed_limit is not None
    assert scene.speed_limit.curves == ((0.05, 0.1, 0.2),)
    assert len(scene.speed_limit.patches) == 8
    core = build_core(scene)
    assert core.phase is Phase.STARTING
    assert core.needs.slider
    assert any("slider" in why for why in core.blockers(100.0))
    assert not build_core(parse_scene(SCENE)).needs.slider


def test_the_text_of_the_scene_carries_the_speeds(tmp_path: Path) -> None:
    scene = load(tmp_path)
    (tmp_path / "impact.toml").unlink()
    again = parse_scene(scene.text, recorded=True)
    assert again.speed_limit == scene.speed_limit
    assert parse_scene(scene.text).speed_limit == scene.speed_limit


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("UR5e", "UR10e"),
        lambda text: text.replace("radius1_mm = 37.6", "radius1_mm = 37.7"),
        lambda text: text.replace("xyz_mm = [0, 0, 80]", "xyz_mm = [0, 0, 81]"),
        lambda text: text.replace("thickness_mm = 6", "thickness_mm = 5"),
        lambda text: text.replace("deceleration_rad_s2 = 10", "deceleration_rad_s2 = 5"),
        lambda text: text.replace('kind = "stop"', 'kind = "comply"'),
    ],
)
def test_another_scene_is_refused(tmp_path: Path, change: Callable[[str], str]) -> None:
    assert change(LIMITED) != LIMITED
    with pytest.raises(SceneError, match="are of another scene"):
        load(tmp_path, change(LIMITED))


def test_a_slow_reaction_is_refused_beside_it(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="a reaction is slow"):
        load(tmp_path, LIMITED.replace('kind = "stop"', 'kind = "slow"'))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"format": 2}, "format must be 1, got 2"),
        ({"levers_mm": [100.0, 100.0, 400.0]}, "levers_mm must rise"),
        ({"curve": [{"region": "hand", "speeds_mm_s": [50.0]}]}, "one speed for each"),
        ({"curve": []}, "there must be one"),
        ({"patch": []}, "there must be one"),
        ({"lowest_deg": [0.0] * 6}, "six numbers each, or none"),
        ({"levers_mm": [float("nan")]}, "levers_mm"),
        ({"fingerprint": 7}, "fingerprint must be text"),
        (
            {"patch": [{"sensor": NAME, "u_mm": 0.0, "phi_deg": 0.0, "curve": 9, "any_curve": 0}]},
            "a curve that there is",
        ),
        (
            {"patch": [{"sensor": "?", "u_mm": 0.0, "phi_deg": 0.0, "curve": 0, "any_curve": 0}], "patches": 1},
            "not in both",
        ),
        ({"curves": 2}, "was cut or changed"),
    ],
)
def test_a_table_with_a_mistake_is_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        load(tmp_path, **changes)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read"),
        (b"\xff\xfe", "is not TOML"),
        (b"[limits]\n", "must hold one table"),
        (b"#" * ((1 << 20) + 1), "cannot be read"),
    ],
)
def test_a_file_that_is_none_is_refused_with_what_to_do(tmp_path: Path, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / "impact.toml").write_bytes(content)
    (tmp_path / "scene.toml").write_text(LIMITED, encoding="utf-8")
    with pytest.raises(SceneError, match=message):
        load_scene(tmp_path / "scene.toml")


def test_a_recording_names_no_file() -> None:
    with pytest.raises(SceneError, match="a recording carries the speeds"):
        parse_scene(LIMITED, recorded=True)


def test_another_section_of_the_same_sheet_is_another_scene(tmp_path: Path) -> None:
    """Normals differ, and with them the speeds along them; radii and pose are the same."""
    bends = "bend_wrap_deg = [90, 90, 90, 90]\nbend_turn_deg = [{}, {}, {}, {}]\nheight_mm"
    round_one = SCENE.replace("radius2_mm = 37.2", "radius2_mm = 37.6").replace(
        "height_mm", bends.format(90, 90, 90, 90), 1
    )
    oval = round_one.replace("[90, 90, 90, 90]\nheight", "[120, 60, 120, 60]\nheight")
    assert oval != round_one
    assert limit_fingerprint(parse_scene(oval)) != limit_fingerprint(parse_scene(round_one))


def along(way: tuple[float, ...], normal: tuple[float, ...]) -> float:
    return sum(a * b for a, b in zip(way, normal, strict=True))


BOX = "bend_wrap_deg = [80, 10, 80, 10, 80, 10, 80, 10]\nbend_turn_deg = [0, 90, 0, 90, 0, 90, 0, 90]\n"


@pytest.mark.parametrize("bends", ["", BOX], ids=["cylinder", "box"])
def test_no_place_is_faster_than_its_patches_are_held_to_be(bends: str) -> None:
    """Of a moving cylinder, and of a moving box, whose normal turns by a right angle between two patches."""
    even = SCENE.replace("radius2_mm = 37.2", "radius2_mm = 37.6")
    scene = parse_scene(even.replace("height_mm", f"{bends}height_mm", 1))
    (place,) = place_on_arm(scene)
    wrap = place.frustum.frustum.wrap
    patches = [LimitedPatch(NAME, 0.13, wrap * n / 16, 0, 0) for n in range(16)]
    table = SpeedLimitScene(1, *[""] * 7, 0.01, 9.0, (), (), (0.1,), ((1.0,),), tuple(patches))
    limit = _speed_limit(scene, table, arm_model("UR5e")).speeds
    normals = [place.place(0.13, wrap * n / 997)[1] for n in range(997)]
    for degrees in range(360):
        way = (0.0, math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))  # the tube lies along x
        fastest = max(along(way, normal) for normal in normals)
        seen = max(along(way, patch.normal) for patch in limit.patches)
        assert fastest <= limit.between * seen + 1e-9


def test_a_file_that_was_cut_at_a_row_is_refused(tmp_path: Path) -> None:
    rows = table()["speed_limit"]["patch"]
    for left in range(1, len(rows)):  # what is left is TOML, and every row in it is whole
        with pytest.raises(SceneError, match="the file was cut or changed"):
            load(tmp_path, patch=rows[:left])
    load(tmp_path, patch=rows)
