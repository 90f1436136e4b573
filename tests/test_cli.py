"""The command line: examples in every help, exit codes, JSON, and no traceback for a user's mistake."""

import argparse
import contextlib
import importlib
import importlib.util
import io
import json
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from coneskin import __version__
from coneskin.cli import COMMANDS, main
from coneskin.core.version import code_build

from .scene.scenes import SKIN_ONLY, record

Output = pytest.CaptureFixture[str]


def run(*words: object) -> int:
    """Return the exit code, also where argparse ends the program."""
    try:
        return main([str(word) for word in words])
    except SystemExit as exc:
        return exc.code if isinstance(exc.code, int) else 1


@pytest.mark.skipif(sys.platform != "linux", reason="the names of files are texts there")
@pytest.mark.long
def test_a_name_that_is_no_text_is_written_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path / "odd\udcff.rec")
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="strict", write_through=True)
    monkeypatch.setattr(sys, "stdout", printed)
    assert run("replay", tmp_path) == 2
    assert run("runs", "export", tmp_path / "odd\udcff.rec", "-o", tmp_path / "out\udcff", "--format", "csv") == 0
    said = printed.buffer.getvalue().decode()  # type: ignore[attr-defined]
    assert "/odd\\udcff.rec" in said
    assert "/out\\udcff/" in said


@pytest.mark.parametrize("command", COMMANDS)
def test_the_module_of_each_command_is_there(command: str) -> None:
    assert importlib.util.find_spec(COMMANDS[command][0]) is not None


def parsers(command: str) -> dict[str, argparse.ArgumentParser]:
    """Return the parser of a command and those of its jobs, by their names."""
    module = importlib.import_module(COMMANDS[command][0])
    parser = argparse.ArgumentParser(prog=f"coneskin {command}", epilog=str(module.__doc__).partition("\n\n")[2])
    module.add_arguments(parser)
    jobs = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    inner = {f"{command} {name}": made for action in jobs for name, made in action.choices.items()}
    return {command: parser, **inner}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_help_shows_an_example_and_exit_codes_as_wide_as_the_terminal(
    command: str, capsys: Output, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # an example of design writes a file as it is parsed
    monkeypatch.setenv("COLUMNS", "70")
    for name, parser in parsers(command).items():
        assert run(*name.split(), "--help") == 0
        text = capsys.readouterr().out
        assert text.startswith("usage: coneskin " + ("design [LINK]" if name == "design" else name))
        assert "exit code" in text.lower(), name
        about = text[text.index("\n\n") :]  # below the usage, in which argparse breaks no option
        assert [line for line in about.splitlines() if len(line) > 70 and len(line.split()) > 2] == [], name
        examples = re.findall(rf"^  coneskin {name} (.*)$", parser.epilog or "", re.MULTILINE)
        assert examples, name
        for example in examples:
            with contextlib.suppress(SystemExit):  # it writes a file, and ends; a usage would be on stderr
                parser.parse_args(shlex.split(re.split(r" {2,}", example)[0]))  # the rest says what it does
    assert "usage:" not in capsys.readouterr().err


#: they write files; what the first prints goes into one
NO_JSON = {"heartbeat", "init", "firmware"}


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - NO_JSON))
def test_a_program_can_read_what_a_command_prints(command: str) -> None:
    for name, parser in parsers(command).items():
        jobs = any(isinstance(action, argparse._SubParsersAction) for action in parser._actions)
        assert jobs or "--json" in parser._option_string_actions, name


def test_the_help_of_the_program_names_all_commands(capsys: Output) -> None:
    assert run("--help") == 0
    text = capsys.readouterr().out
    assert all(f"\n    {command}" in text for command in COMMANDS)
    assert "Not a safety-rated device" in text
    assert "example:" in text
    assert run("--version") == 0
    assert capsys.readouterr().out == f"coneskin {__version__} ({code_build()})\n"


@pytest.mark.long
@pytest.mark.parametrize("command", COMMANDS)
def test_only_the_module_of_the_chosen_command_is_imported(command: str) -> None:
    code = (
        "import sys; from coneskin.cli import main\n"
        f"try: main([{command!r}, '--help'])\nexcept SystemExit: pass\n"
        "print('LOADED', *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    loaded = set(done.stdout.split("LOADED", 1)[1].split())
    assert COMMANDS[command][0] in loaded
    others = {module for name, (module, _) in COMMANDS.items() if name != command}
    assert not others & loaded
    assert not {"rtde_control", "serial", "trimesh", "matplotlib", "ezdxf"} & loaded


@pytest.mark.parametrize(
    "words",
    [(), ("fly",), ("unroll",), ("unroll", "--radius1-mm", "x", "--height-mm", "1"), ("replay",), ("guard", "--fast")],
)
def test_wrong_words_end_with_2_and_the_usage(words: tuple[str, ...], capsys: Output) -> None:
    assert run(*words) == 2
    assert capsys.readouterr().err.startswith("usage: coneskin")


@pytest.mark.parametrize(
    ("word", "near"), [("unrol", "unroll"), ("simur", "sim-ur"), ("gaurd", "guard"), ("designs", "design")]
)
def test_a_command_with_a_slip_is_named(word: str, near: str, capsys: Output) -> None:
    assert run(word, "--radius1-mm", "40") == 2
    assert capsys.readouterr().err.endswith(f"there is no command {word}; did you mean {near}?\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("replay", "--evnts", "x"), "replay: error: unrecognized arguments: --evnts; did you mean --events?"),
        (("doctor", "a.toml", "b.toml"), "doctor: error: unrecognized arguments: b.toml"),
        (("runs", "cut", "x", "--arond", "3"), "runs: error: unrecognized arguments: --arond 3"),
    ],
)
def test_an_option_with_a_slip_is_named(words: tuple[str, ...], said: str, capsys: Output) -> None:
    assert run(*words) == 2
    assert capsys.readouterr().err.endswith(f"coneskin {said}\n")


@pytest.mark.parametrize("word", ["check", "validate"])
def test_who_wants_to_check_a_scene_is_sent_to_the_doctor(word: str, capsys: Output) -> None:
    assert run(word, "scene.toml") == 2
    assert capsys.readouterr().err.endswith("coneskin doctor SCENE --check does that\n")


@pytest.mark.parametrize("words", [(), ("xyz",)])
def test_without_a_command_all_are_named(words: tuple[str, ...], capsys: Output) -> None:
    assert run(*words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert all(command in err for command in COMMANDS)


UNROLL = ("unroll", "--radius1-mm", 40, "--radius2-mm", 70, "--height-mm", 150)


def test_unroll_prints_the_sector_of_the_issue(capsys: Output) -> None:
    """By hand: s = sqrt(150^2 + 30^2), r1 = 40 s/30, r2 = 70 s/30, theta0 = 360 deg * 30/s."""
    assert run(*UNROLL, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    s = math.sqrt(150.0**2 + 30.0**2)
    assert facts["slant_mm"] == pytest.approx(s, rel=1e-15)
    assert facts["r1_mm"] == pytest.approx(40.0 * s / 30.0, rel=1e-14)
    assert facts["r2_mm"] == pytest.approx(70.0 * s / 30.0, rel=1e-14)
    assert facts["theta0_deg"] == pytest.approx(360.0 * 30.0 / s, rel=1e-14)
    assert facts["half_angle_deg"] == pytest.approx(math.degrees(math.atan2(30.0, 150.0)), rel=1e-14)
    assert facts["arc2_mm"] == pytest.approx(2.0 * math.pi * 70.0, rel=1e-14)
    assert facts["area_cm2"] == pytest.approx(math.pi * (4.0 + 7.0) * s / 10.0, rel=1e-14)


def test_unroll_for_people_says_the_same_numbers(capsys: Output) -> None:
    assert run(*UNROLL, "--wrap-deg", 180, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert run(*UNROLL, "--wrap-deg", 180) == 0
    lines = {line[:11].strip(): line[11:].split() for line in capsys.readouterr().out.splitlines()}
    for key, value in facts.items():
        name, unit = key.rsplit("_", 1)
        assert lines[name.replace("_", " ")] == [f"{value:.6f}", unit]


def test_unroll_a_cylinder(capsys: Output) -> None:
    assert run("unroll", "--radius1-mm", 54, "--height-mm", 434, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["r1_mm"], facts["r2_mm"], facts["theta0_deg"]) == (None, None, 0.0)
    assert facts["arc1_mm"] == facts["arc2_mm"] == pytest.approx(2.0 * math.pi * 54.0, rel=1e-14)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--radius1-mm", "nan", "--height-mm", 1), "--radius1-mm must be 0 or from 1 to 5000 mm, got nan mm"),
        (("--radius1-mm", -1, "--height-mm", 1), "--radius1-mm must be 0 or from 1 to 5000 mm, got -1.0 mm"),
        (("--radius1-mm", 0.04, "--height-mm", 150), "got 0.04 mm: is that in metres? Then write 40"),
        (("--radius1-mm", 40, "--height-mm", 0.15), "got 0.15 mm: is that in metres? Then write 150"),
        (("--radius1-mm", 1, "--height-mm", "inf"), "--height-mm must be 0 or from 1 to 10000 mm, got inf mm"),
        (("--radius1-mm", 1, "--height-mm", 1, "--wrap-deg", 361), "--wrap-deg must be above 0 to 360 deg, got 361.0"),
        (("--radius1-mm", 0, "--height-mm", 1), "radius1 and radius2 must not both be 0"),
        (("--radius1-mm", 5, "--height-mm", 0), "height must be above 0 where both radii are equal"),
    ],
)
def test_a_link_that_cannot_be(words: tuple[object, ...], message: str, capsys: Output) -> None:
    assert run("unroll", *words) == 1
    out, err = capsys.readouterr()
    assert (out, message in err) == ("", True), err
    assert "Traceback" not in err


def test_a_link_with_two_mistakes(capsys: Output) -> None:
    assert run("unroll", "--radius1-mm", "nan", "--height-mm", "nan") == 1
    err = capsys.readouterr().err
    assert "the link: 2 mistakes" in err
    assert "--radius1-mm" in err
    assert "--height-mm" in err


@pytest.mark.parametrize("command", ["guard", "replay"])
def test_a_file_that_is_not_there_or_is_a_folder_or_is_nothing(
    command: str, tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO())  # the guard listens to a person
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    (tmp_path / "empty").write_bytes(b"")
    for name in ("missing", ".", "binary", "empty"):
        assert run(command, tmp_path / name) == 1
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith(f"coneskin {command}: "), err
        assert "Traceback" not in err


def test_guard_check_says_what_is_in_a_scene(tmp_path: Path, capsys: Output) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SKIN_ONLY)
    assert run("doctor", scene, "--check", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {
        "scene": "scene.toml",
        "sensor sensor 0/0": "id 0/0 on the tube: radius 54 to 54 mm, height 434 mm, wrap 360 deg, at (0, 0, 0) mm, "
        "rpy (0, 0, 0) deg, in the mesh frame",
        "place on sensor 0/0": "certain after about 3 frames of a firm touch: then a second contact of about "
        "2 N (0.7 millisiemens), 20 deg off, is excluded; after 512 frames one of 0.048 millisiemens",
        "source": "virtual",
        "monitoring": "skin silent or late for 50 ms or without noise for 1000 frames: a fault",
        "touches": "1",
    }
    assert run("doctor", scene, "--check") == 0
    assert "id 0/0 on the tube" in capsys.readouterr().out
    scene.write_text(SKIN_ONLY.replace("54", "0.054"))
    assert run("doctor", scene, "--check") == 1
    assert "2 mistakes" in capsys.readouterr().err


def test_replay_says_that_the_events_are_the_same(tmp_path: Path, capsys: Output) -> None:
    record(tmp_path / "run.rec")
    assert run("replay", tmp_path, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["same"], facts["missing"], facts["differences"]) == (True, None, [])
    assert [event["name"] for event in facts["events"]][:3] == ["activated", "stopping", "contact"]
    assert facts["events"][2]["t"] == pytest.approx(0.6, abs=0.02)  # the touch begins then, and its force rises 10 ms
    assert run("replay", tmp_path / "run.rec", "--events") == 0
    out = capsys.readouterr().out
    assert "touch on towards the wrist (forearm)" in out
    assert "the events are the same, bit by bit" in out


@pytest.mark.long
def test_replay_of_a_run_that_is_cut_or_changed(tmp_path: Path, capsys: Output) -> None:
    record(tmp_path / "run.rec")
    data = (tmp_path / "run.rec").read_bytes()
    (tmp_path / "cut.rec").write_bytes(data[: len(data) // 2])
    assert run("replay", tmp_path / "cut.rec") == 4
    printed = capsys.readouterr().out
    assert "missing: the recording was not closed" in printed
    assert "INCOMPLETE" in printed
    assert run("replay", tmp_path / "cut.rec", "--allow-incomplete") == 0
    capsys.readouterr()
    scene = tmp_path / "deaf.toml"
    scene.write_text(SKIN_ONLY)
    assert run("replay", tmp_path, "--scene", scene) == 0
    assert "touch is missing" in capsys.readouterr().out
    assert run("replay", tmp_path, "--scene", tmp_path / "none.toml") == 1
    assert "none.toml: 1 mistake" in capsys.readouterr().err


@pytest.mark.long
def test_a_recording_of_another_guard_ends_with_1(tmp_path: Path, capsys: Output) -> None:
    """The same bytes and other events: the exit code tells a script."""
    record(tmp_path / "run.rec")
    path = tmp_path / "other.rec"
    from coneskin.core.recording.reader import read_recording
    from coneskin.core.recording.recorder import Recorder
    from coneskin.robot.guard.signals.journal import BlockKind

    with Recorder(path) as recorder:
        recorder.write(*(block for block in read_recording(tmp_path / "run.rec") if block.kind != BlockKind.EVENT))
    assert run("replay", path) == 1
    assert re.search(r"^  0\.\d+ s  activated: is new$", capsys.readouterr().out, re.MULTILINE)


def test_a_run_in_which_nothing_happened_is_nothing_to_compare(tmp_path: Path, capsys: Output) -> None:
    from coneskin.core.recording.reader import read_recording
    from coneskin.core.recording.recorder import Recorder

    record(tmp_path / "run.rec")
    with Recorder(tmp_path / "empty.rec") as recorder:
        recorder.write(next(iter(read_recording(tmp_path / "run.rec"))))
    assert run("replay", tmp_path / "empty.rec") == 4
    assert "INCOMPLETE: no event that could be compared" in capsys.readouterr().out


def test_a_reader_that_is_gone_is_no_error() -> None:
    """As in ``coneskin ... | head -1``."""
    process = subprocess.Popen(
        [sys.executable, "-m", "coneskin", "unroll", "--radius1-mm", "54", "--height-mm", "434"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    process.stdout.close()
    _, err = process.communicate(timeout=60)
    assert b"Traceback" not in err
    assert b"Exception" not in err
