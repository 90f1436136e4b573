from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from coneskin.cli import main
from coneskin.commands import permissible
from coneskin.impact.permissible_speed import speed_map
from tests.support.scenes import forearm_scene

SCENE = forearm_scene() + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n"
LIMITS = """\
[limits]
edition = "invented"
transcribed_by = "one"
verified_by = "other"
[[limits.region]]
name = "hand"
mass_kg = 0.6
transient_force_n = 150
lasting_force_n = 120
[measured]
reaction_ms = 12
deceleration_rad_s2 = 9
by = "a test"
"""


@pytest.fixture(autouse=True)
def _few_masses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (1.0, float("inf")))


def write(folder: Path, scene: str = SCENE, limits: str = LIMITS) -> list[str]:
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    (folder / "limits.toml").write_text(limits, encoding="utf-8")
    return ["permissible", str(folder / "scene.toml"), "--limits", str(folder / "limits.toml")]


@pytest.mark.long
def test_it_prints_draws_and_writes_what_a_scene_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    words = write(tmp_path)
    picture, output = tmp_path / "impact.png", tmp_path / "impact.toml"
    assert main([*words, "-o", str(output), "--picture", str(picture), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verified_by"] == "other"
    assert len(found["patch"]) == 48
    assert {"link", "point_mm", "normal", "curve", "any_curve"} <= set(found["patch"][0])
    assert picture.read_bytes().startswith(b"\x89PNG")
    (tmp_path / "scene.toml").write_text(
        SCENE.replace('model = "UR5e"', 'model = "UR5e"\nspeed_limit_from = "impact.toml"'), encoding="utf-8"
    )
    assert main(["doctor", str(tmp_path / "scene.toml"), "--check"]) == 0
    assert "permissible speeds" in capsys.readouterr().out


def test_a_mistake_is_one_line_and_not_a_traceback(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(write(tmp_path, limits=LIMITS.replace('verified_by = "other"', ""))) == 1
    assert "verified_by is missing" in capsys.readouterr().err
    assert main(write(tmp_path, scene=forearm_scene())) == 1
    assert "[padding]" in capsys.readouterr().err
    assert main([*write(tmp_path), "-o", str(tmp_path / "no" / "impact.toml")]) == 1
    assert "there is no folder" in capsys.readouterr().err


def test_a_patch_is_told_where_it_lies_and_what_mass_meets_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_map, "map_table", lambda _: {"speed_limit": {"digest": "1", "patch": [{}, {}]}})
    patches = [SimpleNamespace(link=k, point=(0.1, -0.2, 0.3 * k), normal=(0.0, 1.0, 0.0)) for k in (2, 4)]
    found = SimpleNamespace(patches=patches, masses=(5.5, math.inf))
    assert permissible._plain(found) == {  # type: ignore[arg-type]
        "patch": [
            {"link": 2, "mass_kg": 5.5, "point_mm": pytest.approx([100.0, -200.0, 600.0]), "normal": [0.0, 1.0, 0.0]},
            {"link": 4, "mass_kg": None, "point_mm": pytest.approx([100.0, -200.0, 1200.0]), "normal": [0.0, 1.0, 0.0]},
        ]
    }
