"""``coneskin runs``: what people see and which exit code a program gets."""

import json
import sys
from pathlib import Path

import pytest

from coneskin.cli import main
from tests.support.paths import COLLISION


def facts(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> dict:
    assert main(["runs", *words, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_a_broken_run_is_listed_and_the_rest_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "run.rec").write_bytes(COLLISION.read_bytes())
    (tmp_path / "a.rec").write_bytes(b"nothing")
    assert main(["runs", "list", str(tmp_path)]) == 1
    head, broken, whole = capsys.readouterr().out.splitlines()
    assert "contacts" in head
    assert "a.rec: cannot be read: " in broken
    assert whole.endswith(f"UR5e    {tmp_path / 'b'}")
    rows = facts(capsys, "list", str(tmp_path), code=1)["runs"]
    assert [row.get("contacts") for row in rows] == [None, 1]
    assert (rows[1]["arm"], rows[1]["reaction"], rows[1]["missing"]) == ("UR5e", "retreat", None)


def test_info_tells_what_is_in_a_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["runs", "info", str(COLLISION)]) == 0
    out = capsys.readouterr().out
    assert "arm UR5e, reaction retreat; passed on" in out
    assert "sensors: forearm skin (forearm)" in out
    assert "whole: nothing is missing" in out
    assert "touch on forearm skin" in out


def test_verify_tells_an_incomplete_run_by_its_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    torn = tmp_path / "torn.rec"
    torn.write_bytes(COLLISION.read_bytes()[:-40_000])
    (row,) = facts(capsys, "verify", str(torn), code=4)["runs"]
    assert not row["whole"]
    assert row["said"].startswith("incomplete: ")
    assert main(["runs", "verify", str(COLLISION)]) == 0
    assert main(["runs", "verify", str(tmp_path / "nowhere")]) == 1
    assert "there is no run" in capsys.readouterr().err


def test_what_lies_beside_a_run_in_its_folder_is_verified_as_well(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "run.rec").write_bytes(COLLISION.read_bytes())
    (tmp_path / "later").mkdir()
    (tmp_path / "later" / "run.rec").write_bytes(COLLISION.read_bytes()[:-40_000])
    rows = facts(capsys, "verify", str(tmp_path), code=4)["runs"]
    assert {row["path"]: row["whole"] for row in rows} == {
        str(tmp_path / "run.rec"): True,
        str(tmp_path / "later" / "run.rec"): False,
    }
    assert len(facts(capsys, "list", str(tmp_path))["runs"]) == 2


@pytest.mark.long
def test_cut_and_diff(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "cut.rec"
    made = facts(capsys, "cut", str(COLLISION), "--around", "2.95", "--keep", "0.6", "-o", str(target))
    assert made["size_bytes"] == target.stat().st_size < 300_000
    same = facts(capsys, "diff", str(target))
    assert (same["same"], same["differences"], same["new"], same["missing"]) == (True, [], 0, 0)
    other = facts(capsys, "diff", str(target), "--set", "reaction.kind=stop", code=1)
    assert other["labels"] == ["today's code", "reaction.kind = stop"]
    assert [d["subject"] for d in other["differences"]] == ["retreat"]
    assert main(["runs", "diff", str(target), "--tolerance", "place=1"]) == 1
    assert "there is no tolerance place; there are place_mm" in capsys.readouterr().err
    assert main(["runs", "diff", *[str(target)] * 3]) == 2
    assert "diff compares one run, or two, got 3; many runs: coneskin replay RUN" in capsys.readouterr().err


@pytest.mark.long
def test_another_version_of_the_code_is_asked_in_its_own_interpreter(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = facts(capsys, "diff", str(COLLISION), "--python", sys.executable)
    assert found["labels"] == [sys.executable, "today's code"]
    assert (found["same"], found["paired"]) == (True, 14)
    assert main(["runs", "diff", str(COLLISION), "--python", str(tmp_path / "python")]) == 1
    assert "does not replay" in capsys.readouterr().err
    assert main(["runs", "diff", str(COLLISION), str(COLLISION), "--python", sys.executable]) == 1
    assert "leave B out" in capsys.readouterr().err


def test_export_names_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (file,) = facts(capsys, "export", str(COLLISION), "-o", str(tmp_path / "run.npz"))["files"]
    assert file["path"] == str(tmp_path / "run.npz")
    assert (tmp_path / "run.npz").stat().st_size > 10_000


@pytest.mark.long
def test_a_cut_is_around_the_first_touch_where_nothing_else_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "new" / "folder" / "touch.rec"
    made = facts(capsys, "cut", str(COLLISION), "-o", str(target))
    assert made["contacts"] == 1
    assert made["since_s"] < 2.949 < made["until_s"]
    assert target.stat().st_size == made["size_bytes"]
    (tmp_path / "file").touch()
    assert main(["runs", "cut", str(COLLISION), "-o", str(tmp_path / "file" / "touch.rec")]) == 1
    assert "cannot make the recording" in capsys.readouterr().err
