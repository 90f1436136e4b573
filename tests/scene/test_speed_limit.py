"""The table [speed_limit]: it comes from a file, holds for one scene, and travels with a recording."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w

from coneskin.core.errors import SceneError
from coneskin.robot.arm.models import arm_model
from coneskin.robot.guard.phase import Phase
from coneskin.scene.build import _speed_limit, build_core, place_on_arm
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.tables.speed_limit_tables import limit_fingerprint
from coneskin.scene.values.scene import LimitedPatch, Scene, SpeedLimitScene
from tests.support.scenes import forearm_scene
from tests.support.speed_limit_values import limit_values

SCENE = forearm_scene() + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n"
LIMITED = SCENE.replace('model = "UR5e"', 'model = "UR5e"\nspeed_limit_from = "impact.toml"')
NAME = parse_scene(SCENE).sensors[0].sensor.name
SLANT = 1e3 * parse_scene(SCENE).sensors[0].sensor.frustum.slant  # mm


def patch(**changes: object) -> dict[str, object]:
    return {"sensor": NAME, "u_mm": 0.0, "phi_deg": 0.0, "curve": 0, "any_curve": 0} | changes


def around(*degrees: float) -> list[dict[str, object]]:
    """Patches at both ends of the sheet."""
    return [patch(u_mm=u, phi_deg=phi) for u in (0.0, SLANT) for phi in degrees]


def curve(*speeds: float) -> dict[str, object]:
    return {"curve": [{"region": "hand", "speeds_mm_s": list(speeds)}]}


def table(**changes: object) -> dict[str, object]:
    values: dict[str, object] = {
        "deceleration_rad_s2": 9.0,
        "curve": [{"region": "hand", "speeds_mm_s": [50.0, 100.0, 200.0]}],
        "patch": around(0.0, 90.0, 180.0, 270.0),
    }
    return {"speed_limit": limit_values(parse_scene(SCENE), **values | changes)}


def load(folder: Path, text: str = LIMITED, **changes: object) -> Scene:
    """Load a scene with a table whose digest is right."""
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


def test_a_digest_is_wanted_of_a_recording_too(tmp_path: Path) -> None:
    scene = load(tmp_path)
    tables = tomllib.loads(scene.text)
    del tables["speed_limit"]["digest"]
    text = tomli_w.dumps(tables)
    with pytest.raises(SceneError, match=r"the key digest is missing: .* run `coneskin permissible`"):
        parse_scene(text)
    changed = text.replace("[speed_limit]", '[speed_limit]\ndigest = "0"', 1)
    with pytest.raises(SceneError, match="digest is not that of the table"):
        parse_scene(changed, recorded=True)


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
        ({"levers_mm": [100.0, 100.0, 400.0]}, "levers_mm must rise"),
        ({"curve": [{"region": "hand", "speeds_mm_s": [50.0]}]}, "one speed for each"),
        ({"curve": []}, "there must be one"),
        ({"patch": []}, "there must be one"),
        ({"lowest_deg": [0.0] * 6}, "six numbers each, or none"),
        ({"levers_mm": [float("nan")]}, "levers_mm"),
        ({"fingerprint": 7}, "fingerprint must be text"),
        ({"patch": [*around(0, 90, 180, 270), patch(curve=9)]}, "patch 8 needs a curve that there is, 0 to 0"),
        ({"patch": [*around(0, 90, 180, 270), patch(any_curve=1)]}, "patch 8 needs a curve that there is"),
        ({"patch": [patch(sensor="?")]}, rf"{NAME}: not in both the scene and the speeds"),
        ({"patch": [*around(0, 90, 180, 270), patch(sensor="?")]}, r"[?]: not in both the scene and the speeds"),
        ({"patch": [*around(0, 90, 180, 270), patch(u_mm=260.1)]}, "u_mm = 260.1 is off the sheet, .* at 260 mm"),
        ({"patch": [patch(u_mm=0.0), patch(u_mm=130.0)]}, "no patch from 0 to 360 deg at its end u_mm = 0"),
        ({"patch": around(0, 90, 180, 270)[:4]}, "no patch at its end u_mm = 260"),
        ({"patch": around(0, 90, 180, 270)[4:]}, "no patch at its end u_mm = 0"),
        ({"patch": around(0, 90, 180)}, "no patch from 180 to 360 deg at its end u_mm = 0"),
        ({"patch": around(0, 90, 180.1, 270)}, "no patch from 90 to 180.1 deg"),
        ({"patch": [*around(0, 90, 180, 270)[:7]]}, "no patch from 180 to 360 deg at its end u_mm = 260"),
        (curve(100.0, 99.0, 200.0), "curve 0: speeds_mm_s must not fall with a longer lever, got 99 mm/s after 100"),
        (curve(50.0, 106.0, 200.0), "curve 0: speeds_mm_s must not grow more than the lever does, from 100 to 200 mm"),
        (curve(0.0, 0.0, 0.0), "last of speeds_mm_s must be above 0 mm/s"),
        (curve(50.0, 60.0, 70.0, 80.0), "curve 0 needs one speed for each of levers_mm: 3, got 4"),
        (
            {"lowest_deg": [-90.0] * 6, "highest_deg": [*[90.0] * 5, -90.1]},
            "joint 6 has a lowest_deg of -90 deg, above its highest_deg of -90.1 deg",
        ),
        ({"lowest_deg": [-364.0] * 6, "highest_deg": [0.0] * 6}, "lowest_deg"),
        ({"patch": [*around(0, 90, 180, 270), patch(phi_deg=361.0)]}, "phi_deg"),
        ({"reaction_ms": -1.0}, "reaction_ms"),
    ],
)
def test_a_table_with_a_mistake_is_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message) as refused:
        load(tmp_path, **changes)
    assert "run `coneskin permissible`" in str(refused.value) or "must be" in str(refused.value)


def test_what_a_search_leaves_of_a_curve_is_no_mistake(tmp_path: Path) -> None:
    """It ends within 1 % of the fastest speed, and may find none for a short lever."""
    for speeds in ((50.0, 101.9, 205.0), (0.0, 0.0, 30.0), (80.0, 80.0, 80.0), (1.0, 2.01, 4.03)):
        load(tmp_path, **curve(*speeds))
    load(tmp_path, lowest_deg=[5.0] * 6, highest_deg=[5.0] * 6)


def test_a_part_of_a_turn_needs_patches_at_both_its_edges(tmp_path: Path) -> None:
    part = LIMITED.replace("height_mm", "wrap_deg = 120\nheight_mm", 1)
    of_part = {"fingerprint": limit_fingerprint(parse_scene(part.replace('speed_limit_from = "impact.toml"\n', "")))}
    load(tmp_path, part, patch=around(0, 60, 120), **of_part)
    for degrees, gap in (((0, 60), "from 60 to 120"), ((60, 120), "from 0 to 60"), ((0, 120), "from 0 to 120")):
        with pytest.raises(SceneError, match=f"no patch {gap} deg"):
            load(tmp_path, part, patch=around(*degrees), **of_part)
    with pytest.raises(SceneError, match="phi_deg = 121 is off the sheet, which ends at 120 deg"):
        load(tmp_path, part, patch=around(0, 60, 120, 121), **of_part)


def test_a_skin_on_the_base_needs_no_speed(tmp_path: Path) -> None:
    """It does not move, and `coneskin permissible` computes none."""
    base = LIMITED.replace(
        "[padding]",
        '[[link]]\nname = "base"\n[[link.sensor]]\nid = 9\nname = "foot"\nradius1_mm = 75\nradius2_mm = 75\n'
        "height_mm = 60\nxyz_mm = [0, 0, 10]\n[padding]",
    )
    bare = base.replace('speed_limit_from = "impact.toml"\n', "")
    scene = load(tmp_path, base, fingerprint=limit_fingerprint(parse_scene(bare)))
    assert {item.sensor.name for item in scene.sensors} == {NAME, "foot"}
    assert build_core(scene).needs.slider


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


@pytest.mark.long
@pytest.mark.parametrize("bends", ["", BOX], ids=["cylinder", "box"])
def test_no_place_is_faster_than_its_patches_are_held_to_be(bends: str) -> None:
    """Of a moving cylinder, and of a moving box, whose normal turns by a right angle between two patches."""
    even = SCENE.replace("radius2_mm = 37.2", "radius2_mm = 37.6")
    scene = parse_scene(even.replace("height_mm", f"{bends}height_mm", 1))
    (place,) = place_on_arm(scene)
    wrap = place.frustum.frustum.wrap
    patches = [LimitedPatch(NAME, 0.13, wrap * n / 16, 0, 0) for n in range(16)]
    table = SpeedLimitScene(*[""] * 7, 0.01, 9.0, (), (), (0.1,), ((1.0,),), tuple(patches))
    limit = _speed_limit(scene, table, arm_model("UR5e")).speeds
    normals = [place.place(0.13, wrap * n / 997)[1] for n in range(997)]
    for degrees in range(360):
        way = (0.0, math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))  # the tube lies along x
        fastest = max(along(way, normal) for normal in normals)
        seen = max(along(way, patch.normal) for patch in limit.patches)
        assert fastest <= limit.between * seen + 1e-9


def test_a_file_that_was_cut_or_changed_is_refused(tmp_path: Path) -> None:
    """At any line or within one: what is left may be TOML with every key in range, and less than was written."""
    rows = [{"region": "hand", "speeds_mm_s": [50.0, 100.0, 200.0]} for _ in range(11)]
    patches = around(0.0, 90.0, 180.0, 270.0)
    patches[-1]["any_curve"] = 10
    load(tmp_path, curve=rows, patch=patches)
    path = tmp_path / "impact.toml"
    content = tomllib.loads(path.read_text(encoding="utf-8"))["speed_limit"]
    whole = tomli_w.dumps({"speed_limit": {key: value for key, value in content.items() if key != "patch"}})
    for row in content["patch"]:
        whole += "[[speed_limit.patch]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in row.items())
    assert whole.endswith("any_curve = 10\n")
    within = range(len(whole) - 40, len(whole) - 1)
    for end in {*within, *(match.start() for match in re.finditer(r"\[\[", whole))}:
        path.write_text(whole[:end], encoding="utf-8")
        with pytest.raises(SceneError):
            load_scene(tmp_path / "scene.toml")
    for old, new in (("phi_deg = 90.0", "phi_deg = 91.0"), ("100.0,\n", "101.0,\n"), ('"other"', '"another"')):
        assert old in whole
        path.write_text(whole.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(SceneError, match="digest is not that of the table: the file was cut, or changed by hand"):
            load_scene(tmp_path / "scene.toml")
    path.write_text(whole, encoding="utf-8")
    load_scene(tmp_path / "scene.toml")
