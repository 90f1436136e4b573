from __future__ import annotations

import json
from pathlib import Path

import pytest

from coneskin.cli import main
from tests.support.scenes import forearm_scene

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

SCENE = (
    forearm_scene(reaction='kind = "stop"\ndeceleration_rad_s2 = 20')
    + """
[motion]
waypoints_deg = [[-10, -90, 90, -90, -90, 0], [60, -90, 90, -90, -90, 0]]
speed_deg_s = 60
acceleration_deg_s2 = 400
"""
)
BODY = '[[body]]\nkind = "hand"\nxyz_mm = [-192, -120, 587]\nmass_kg = 0.6\nstiffness_n_per_mm = 20\n'


@pytest.mark.long
def test_the_forces_with_and_without_a_guard_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE + BODY)
    assert main(["impact", str(tmp_path / "scene.toml"), "--ways", "guard,nothing", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert 0.0 < found["guard"]["noticed"] < 0.004
    assert 2.0 * found["guard"]["peak"] < found["nothing"]["peak"]
    assert found["nothing"]["noticed"] is None


def test_a_way_that_no_record_permits_is_said_to_stop_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE + BODY.replace("-192", "-900"))
    main(["impact", str(tmp_path / "scene.toml"), "--ways", "stop,retreat", "--longest-s", "0.3"])
    said = capsys.readouterr().out
    assert "retreat: the arm only stops where it would move away" in said
    assert "stop: the arm only stops" not in said


def test_an_arm_that_meets_nothing_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE + BODY.replace("-192", "-900"))
    assert main(["impact", str(tmp_path / "scene.toml"), "--ways", "nothing", "--longest-s", "0.3"]) == 0
    assert "met no body" in capsys.readouterr().out
    assert main(["impact", str(tmp_path / "scene.toml"), "--ways", "stop", "--longest-s", "0.3"]) == 1


@pytest.mark.parametrize(
    ("text", "ways", "said"),
    [
        (SCENE, "guard", "a [[body]] to run into"),
        (SCENE.partition("[motion]")[0] + BODY, "guard", "a [motion] to make"),
        (SCENE + BODY, "guard,prayer", "'prayer' is none of guard, stop"),
    ],
)
def test_what_is_missing_is_named(
    text: str, ways: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(text)
    assert main(["impact", str(tmp_path / "scene.toml"), "--ways", ways]) == 1
    assert said in capsys.readouterr().err
