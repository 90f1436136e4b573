"""The script that measures a controller, on the simulated one: it sees what is slow, and believes nothing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commissioning.examination.examination import Doctor
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.ur import measured
from coneskin.robot.ur.measured import read_measured
from tests.support.paths import ROOT
from tests.support.scenes import forearm_scene

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the simulated controller needs several addresses")
SCRIPT = ROOT / "scripts" / "measure_controller.py"


def run(simulated, file, *options, answer=""):
    return subprocess.run(
        [
            sys.executable,
            str(SCRIPT),
            simulated.host,
            "--model",
            "UR5e",
            "--file",
            str(file),
            "--repeat",
            "2",
            *options,
        ],
        input=answer,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


@pytest.mark.promise("P69")
@pytest.mark.long
def test_every_assumption_is_measured_and_a_simulator_with_these_times_measures_the_same(tmp_path):
    odd, again = tmp_path / "odd.json", tmp_path / "again.json"
    options = (
        "--yes",
        "--joints",
        "6",
        "--speeds",
        "25",
        "--motions",
        "speedj",
        "servoj",
        "--paths",
        "program",
        "command",
    )
    with SimulatedController("UR5e", free_host(), start_delay_ms=300) as simulated:
        done = run(simulated, odd, *options, "--protective")
        assert done.returncode == 0, done.stderr
        state = simulated.state()
        assert state["safety"] == "PROTECTIVE_STOP"
        assert abs(state["q"][5]) < 0.31
        assert state["slider"] == 1.0
    facts = json.loads(odd.read_text())
    assert facts["complete"]
    assert facts["start_s"]["p50"] > 0.29
    assert {(stop["path"], stop["motion"]) for stop in facts["stops"]} == {
        (path, motion) for path in ("program", "command") for motion in ("speedj", "servoj")
    }
    assert all(0.0 < stop["way_rad"]["p50"] < 0.2 for stop in facts["stops"])
    facts["watchdog_s"]["p50"] = 0.5
    odd.write_text(json.dumps(facts))
    with SimulatedController("UR5e", free_host(), measured=odd) as simulated:
        assert run(simulated, again, *options, "--speeds", "25", "--paths", "command").returncode == 0
    other = json.loads(again.read_text())
    assert other["start_s"]["p50"] > 0.29
    assert other["watchdog_s"]["p50"] > 0.45
    whole, part = (
        {finding.item for finding in compare(read_measured(file), MonitoringLimits()) if finding.remedy}
        for file in (odd, again)
    )
    assert "measured, a stop" not in whole  # a program that arrives ends the motion before its own first cycle
    assert part == {"measured, a stop", "measured, watchdog"}  # no stop by program was measured: its start counts


def test_it_asks_before_it_moves_and_leaves_the_slider_as_it_was(tmp_path):
    with SimulatedController("UR5e", free_host()) as simulated:
        from coneskin.robot.ur.input_writers import set_slider

        assert set_slider(simulated.host, 0.3, 30.0)
        before = simulated.state()["q"]
        done = run(
            simulated, tmp_path / "m.json", "--joints", "6", "--speeds", "25", "--motions", "movej", answer="n\n"
        )
        assert "joint 6 turns 45 deg" in done.stdout
        assert json.loads((tmp_path / "m.json").read_text())["stops"] == []
        assert simulated.state()["q"] == before
        assert simulated.state()["slider"] == 0.3


def test_what_was_not_measured_is_no_file_and_nobody_to_ask_is_said(tmp_path):
    absent = type("Absent", (), {"host": free_host()})
    done = run(absent, tmp_path / "m.json", "--joints", "6")
    assert done.returncode == 1
    assert "cannot reach the controller" in done.stderr
    assert done.stderr.endswith(f"nothing was measured: {tmp_path / 'm.json'} is not written\n")
    assert done.stdout == ""
    assert not (tmp_path / "m.json").exists()
    assert "make it first" in run(absent, tmp_path / "none" / "m.json").stderr
    with SimulatedController("UR5e", free_host()) as simulated:
        done = run(simulated, tmp_path / "m.json", "--joints", "6", "--repeat", "1", answer="")
    assert done.returncode == 1
    assert "standard input is closed; run it in a terminal, or with --yes" in done.stderr
    assert json.loads((tmp_path / "m.json").read_text())["stops"] == []


@pytest.mark.long
def test_an_arm_that_does_not_move_is_no_measurement(tmp_path):
    with SimulatedController("UR5e", free_host()) as simulated:
        simulated.call("safeguard open")
        done = run(simulated, tmp_path / "m.json", "--yes", "--joints", "6", "--speeds", "25", "--motions", "movej")
        assert done.returncode == 1
        assert "did not" in done.stderr
        assert not (tmp_path / "m.json").exists()


def compare(found, limits, watchdog_hz=4.0):
    return measured.compare(found, limits.escalate, limits.stop_budget, watchdog_hz)


def facts(**change):
    some = {"n": 1, "p50": 0.01, "p95": 0.01, "worst": 0.01}
    stop = {
        "path": "program",
        "motion": "movej",
        "joint": 1,
        "speed": 1.0,
        "slows_s": some,
        "stands_s": some,
        "way_rad": some,
    }
    base = {"model": "UR5e", "version": "5.25", "date": "now", "start_s": some, "watchdog_s": some, "stops": [stop]}
    return base | change


def stopped(slows, **change):
    made = facts(**change)
    made["stops"][0]["slows_s"] = slows
    return made


def read(tmp_path: Path, made):
    (tmp_path / "m.json").write_text(json.dumps(made))
    return read_measured(tmp_path / "m.json")


def test_limits_follow_what_was_measured(tmp_path):
    assert [f.verdict for f in compare(read(tmp_path, facts()), MonitoringLimits())] == ["ok"] * 3
    slow = {"n": 1, "p50": 0.3, "p95": 0.3, "worst": 0.3}
    found = compare(read(tmp_path, stopped(slow)), MonitoringLimits())
    assert [f.verdict for f in found] == ["ok", "bad", "ok"]
    assert found[1].remedy.startswith("escalate_ms = 360 in [monitoring]")
    assert compare(read(tmp_path, stopped(slow)), MonitoringLimits(escalate=0.36))[1].verdict == "ok"
    endless = {"n": 1, "p50": 0.42, "p95": 0.42, "worst": 0.42}
    found = compare(read(tmp_path, stopped(endless)), MonitoringLimits())
    assert found[1].remedy.startswith("escalate_ms can be 500 at most: ")
    late = read(tmp_path, facts(watchdog_s={"n": 1, "p50": 0.05, "p95": 0.05, "worst": 0.05}))
    assert compare(late, MonitoringLimits())[2].remedy.startswith("watchdog_hz = 5 in [arm]")
    assert compare(late, MonitoringLimits(), 5.0)[2].verdict == "ok"
    late = facts()
    late["stops"][0]["stands_s"] = slow | {"worst": 0.5}
    assert [f.item for f in compare(read(tmp_path, late), MonitoringLimits())][-1] == "measured, stop"


def test_a_late_start_of_programs_delays_no_stop_that_was_seen_to_show(tmp_path):
    slow = {"n": 1, "p50": 0.3, "p95": 0.3, "worst": 0.3}
    seen = compare(read(tmp_path, facts(start_s=slow)), MonitoringLimits())[1]
    assert seen.verdict == "ok"
    assert "a program starts after 300 ms" in seen.value
    for unseen in (facts(start_s=slow, stops=[]), facts(start_s=slow)):
        for stop in unseen["stops"]:
            stop["path"] = "command"  # says nothing of a program
        found = compare(read(tmp_path, unseen), MonitoringLimits())[1]
        assert found.verdict == "bad"
        assert found.remedy.startswith("escalate_ms = 360 in [monitoring]")


@pytest.mark.parametrize("watchdog_hz", [4.0, 20.0, 100.0])
@pytest.mark.parametrize("late", [0.21, 0.3])
def test_a_watchdog_that_no_period_mends_is_bad_whatever_the_scene_says(tmp_path, late, watchdog_hz):
    made = facts(watchdog_s={"n": 1, "p50": late, "p95": late, "worst": late})
    found = compare(read(tmp_path, made), MonitoringLimits(), watchdog_hz)[2]
    assert found.verdict == "bad"
    assert "no watchdog_hz mends this" in found.remedy
    assert "watchdog_hz =" not in found.remedy


def test_the_next_look_at_a_scene_compares_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Doctor, "examine", lambda doctor: None)
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(forearm_scene())
    read(tmp_path, stopped({"n": 1, "p50": 0.3, "p95": 0.3, "worst": 0.3}))
    assert main(["doctor", "scene.toml", "--measured", "m.json"]) == 1
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == "next: mend what is bad, then coneskin doctor scene.toml --measured m.json"


def test_a_check_compares_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(forearm_scene())
    assert main(["doctor", "scene.toml", "--check"]) == 0
    read(tmp_path, stopped({"n": 1, "p50": 0.3, "p95": 0.3, "worst": 0.3}))
    capsys.readouterr()
    assert main(["doctor", "scene.toml", "--check", "--measured", "m.json"]) == 1
    assert "escalate_ms = 360" in capsys.readouterr().out
    assert main(["doctor", "scene.toml", "--check", "--measured", "m.json", "--json"]) == 1
    *findings, scene = map(json.loads, capsys.readouterr().out.splitlines())
    assert "bad" in [one["verdict"] for one in findings]
    assert "links" in scene or "source" in scene
    read(tmp_path, facts())
    assert main(["doctor", "scene.toml", "--check", "--measured", "m.json"]) == 0


@pytest.mark.parametrize("made", [{}, [], facts(start_s={}), facts(stops=[{}])])
def test_another_file_is_refused(tmp_path, made):
    from coneskin.core.errors import RobotRefused

    with pytest.raises(RobotRefused, match=r"is no file of scripts/measure_controller\.py"):
        read(tmp_path, made)
