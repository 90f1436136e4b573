"""``coneskin doctor``: from a design to a guarded arm without editing a file; exit codes, JSON, a patched scene."""

import contextlib
import io
import os
import sys
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commissioning.examination.examination import Doctor
from coneskin.commissioning.examination.wires import WirePatch
from coneskin.core.finding import Finding, Verdict
from coneskin.robot.sim.process import free_host
from coneskin.scene.reader import load_scene
from tests.support.paths import SHARED_DATA
from tests.support.scenes import forearm_scene, write_passed_record

from ..scene.scenes import SKIN_ONLY

Output = pytest.CaptureFixture[str]
MESH = Path(os.environ.get("CONESKIN_DATA", SHARED_DATA)) / "ur/ur5e/visual"


@pytest.fixture(autouse=True)
def _short_hold_up_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure the hold-ups of this computer for a moment; a user waits ten seconds."""
    monkeypatch.setattr("coneskin.commands.doctor._HOLD_UP_TIME", 0.1)


@pytest.mark.long
@pytest.mark.processes
@pytest.mark.skipif(not MESH.is_dir(), reason=f"there are no meshes in {MESH}")
def test_from_a_mesh_to_a_guarded_arm_in_five_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    """Each command but the first is the one that the one before has named."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO())  # the guard listens to a person
    host = free_host()
    assert main(["design", str(MESH / "forearm.dae"), "-o", "skin", "--no-pictures"]) == 0
    said = [capsys.readouterr().out.splitlines()[-1]]
    for words in (
        ["init", "skin", "--simulated", "--host", host],
        ["doctor", "scene.toml", "--simulated"],
        ["guard", "scene.toml", "--simulated", "--once"],
    ):
        assert main(words) == (3 if words[0] == "guard" else 0)
        said.append(capsys.readouterr().out.splitlines()[-1])
    assert said[0].startswith("next: coneskin init skin --simulated")
    assert said[1:3] == ["next: coneskin doctor scene.toml --simulated", "next: coneskin guard scene.toml --simulated"]


@pytest.mark.parametrize(("words", "typed", "changed"), [(["--yes"], "", True), ([], "y\n", True), ([], "\n", False)])
def test_a_scene_is_changed_where_a_person_agrees(
    words: list[str], typed: str, changed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    def examine(doctor: Doctor) -> None:
        doctor.findings.append(Finding("wires", "bad", "mirrored"))
        doctor.patches.append(WirePatch("sensor 0/0", {"radial_positive": "A"}))

    monkeypatch.setattr(Doctor, "examine", examine)
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    path = tmp_path / "scene.toml"
    path.write_text(forearm_scene())
    assert main(["doctor", str(path), *words]) == 1
    assert '+radial_positive = "A"' in capsys.readouterr().err
    assert load_scene(path).sensors[0].sensor.polarity.radial == ("A" if changed else "B")


@pytest.mark.parametrize(
    ("text", "verdict", "said"),
    [
        (SKIN_ONLY, "ok", "next: coneskin guard scene.toml"),  # which refuses to simulate an arm that is not there
        (forearm_scene(), "ok", "next: coneskin guard scene.toml --simulated"),
        (forearm_scene(), "bad", "next: mend what is bad, then coneskin doctor scene.toml --simulated"),
    ],
)
def test_the_next_command_is_for_what_was_examined(
    text: str, verdict: Verdict, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    monkeypatch.setattr(Doctor, "examine", lambda doctor: doctor.findings.append(Finding("wires", verdict, "")))
    monkeypatch.setattr("coneskin.commands.doctor.simulated_arm", lambda scene: contextlib.nullcontext())
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(text)
    main(["doctor", "scene.toml", "--simulated"])
    assert capsys.readouterr().out.splitlines()[-1] == said


@pytest.mark.parametrize(("passed", "said"), [(False, "commission"), (True, "guard")])
def test_what_was_commissioned_need_not_be_again(
    passed: bool, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    monkeypatch.setattr(Doctor, "examine", lambda doctor: doctor.findings.append(Finding("wires", "ok", "")))
    monkeypatch.setattr("coneskin.commands.doctor.simulated_arm", lambda scene: contextlib.nullcontext())
    path = tmp_path / "scene.toml"
    path.write_text(forearm_scene(reaction='kind = "retreat"'))
    if passed:
        write_passed_record(load_scene(path))
    main(["doctor", str(path), "--simulated"])
    assert capsys.readouterr().out.splitlines()[-1] == f"next: coneskin {said} {path} --simulated"
    main(["doctor", str(path), "--check"])
    assert (f"coneskin commission {path.name} --simulated" in capsys.readouterr().out) is not passed


def test_a_skin_that_is_late_with_each_frame_cannot_be_guarded(tmp_path: Path, capsys: Output) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SKIN_ONLY.replace('kind = "virtual"', 'kind = "virtual"\nrate_hz = 3'))
    assert main(["doctor", str(path), "--check"]) == 1
    assert (
        "too short for source.rate_hz = 3: it must be at least 666.667, the time of 2 frames" in capsys.readouterr().err
    )


def test_a_scene_with_nothing_to_examine_is_bad(tmp_path: Path, capsys: Output) -> None:
    (tmp_path / "scene.toml").write_text("")
    assert main(["doctor", str(tmp_path / "scene.toml")]) == 1
    out = capsys.readouterr().out
    assert "bad  scene: a guard needs a [source]" in out
    assert "bad  scene: a guard needs a [[link]]" in out


def test_a_port_that_is_not_there_is_one_bad_finding(tmp_path: Path, capsys: Output) -> None:
    path = tmp_path / "scene.toml"
    text = forearm_scene(port="/dev/nothing-there")
    path.write_text(text[text.index("[[link]]") : text.index("[reaction]")])
    assert main(["doctor", str(path)]) == 1
    out = capsys.readouterr().out
    assert "bad  skin, permission: there is no /dev/nothing-there; present: " in out
    assert out.split("skin, port: ")[1].splitlines()[0].endswith(" (wanted: it can be opened)")
    assert "not tried  skin, wires: no port" in out
    assert "not tried  arm: the scene has no [arm]" in out
    assert out.splitlines()[-1].startswith("next: mend what is bad, then coneskin doctor")
