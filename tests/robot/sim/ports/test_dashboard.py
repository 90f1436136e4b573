"""The dashboard, line by line, in the words of its published documents."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from coneskin.robot.sim.ports.dashboard import Dashboard, available
from tests.robot.sim.ports.console import WAIT, Console, save_program
from tests.support.paths import ROOT


@pytest.fixture
def console(tmp_path: Path) -> Console:
    (tmp_path / "cell").mkdir()
    for folder in (tmp_path, tmp_path / "cell"):
        save_program(folder, "wait", WAIT)
    (tmp_path / "grip.urp").write_bytes(b"")
    (tmp_path / "default.installation").write_bytes(b"")
    return Console(tmp_path)


def test_a_program_is_loaded_played_paused_and_stopped(console: Console) -> None:
    said = console.say
    assert (said("play"), said("get loaded program")) == ("Failed to execute: play", "No program loaded")
    assert said("load wait.urp") == "Loading program: wait.urp"
    assert said("get loaded program") == "Loaded program: /programs/wait.urp"
    assert said("programState") == "STOPPED wait.urp"
    assert said("pause") == "Failed to execute: pause"
    assert said("play") == "Starting program"
    console.step(10)
    assert (said("programState"), said("running")) == ("PLAYING wait.urp", "Program running: true")
    assert said("isProgramSaved") == "true wait.urp"
    assert said("pause") == "Pausing program"
    assert (said("programState"), said("running")) == ("PAUSED wait.urp", "Program running: false")
    assert said("play") == "Starting program"
    console.step(100)  # it is a loop
    assert said("programState") == "PLAYING wait.urp"
    assert said("stop") == "Stopped"
    assert (said("programState"), said("running")) == ("STOPPED wait.urp", "Program running: false")


def test_a_program_of_another_client_has_its_own_name(console: Console) -> None:
    console.say("load wait.urp")
    console.run("def other():\n  sleep(1)\nend\n")
    console.step(10)
    assert console.say("programState") == "PLAYING other"
    console.say("stop")
    assert console.say("programState") == "STOPPED wait.urp"


def test_loading_stops_the_program_that_runs(console: Console) -> None:
    console.say("load wait.urp")
    console.say("play")
    console.step(10)
    assert console.say("load cell/wait.urp") == "Loading program: cell/wait.urp"
    assert console.say("get loaded program") == "Loaded program: /programs/cell/wait.urp"
    assert console.say("running") == "Program running: false"


@pytest.mark.parametrize("name", ["wait.urp", "cell/wait.urp", "/programs/wait.urp", "/ursim/programs/cell/wait.urp"])
def test_programs_are_found_by_every_kind_of_path(console: Console, name: str) -> None:
    assert console.say(f"load {name}") == f"Loading program: {name}"


@pytest.mark.parametrize("name", ["none.urp", "../wait.urp", "/etc/passwd", "/programs/../../wait.urp", "cell", ""])
def test_what_is_not_in_the_folder_is_not_found(console: Console, name: str) -> None:
    assert console.say(f"load {name}") == f"File not found: {name}"


def test_a_link_that_leads_in_a_circle_is_not_found(console: Console) -> None:
    assert console.interface.folder.root is not None
    (console.interface.folder.root / "circle.urp").symlink_to("circle.urp")
    assert console.say("load circle.urp") == "File not found: circle.urp"


def test_without_a_folder_nothing_is_found() -> None:
    assert Console().say("load wait.urp") == "File not found: wait.urp"
    assert Console().say("saveLog") == "Failed to save log"


def test_a_program_of_nodes_without_its_script_is_not_loaded(console: Console) -> None:
    console.say("load wait.urp")
    assert console.say("load grip.urp") == "Error while loading program: grip.urp"
    assert console.say("get loaded program") == "Loaded program: /programs/wait.urp"


def test_a_program_that_does_not_translate_fails_play_and_is_told(console: Console, tmp_path: Path) -> None:
    (tmp_path / "bad.script").write_text("def bad():\n  x = = 1\nend\n")
    assert console.say("load bad.script") == "Loading program: bad.script"
    assert console.say("play") == "Failed to execute: play"
    assert "line=2" in str(console.controller.notices[0])
    assert console.say("programState") == "STOPPED bad.script"


def test_installations_are_files_too(console: Console) -> None:
    assert console.say("load installation default.installation") == "Loading installation: default.installation"
    assert console.say("load installation other.installation") == "File not found: other.installation"
    assert console.say("load installation wait.urp") == "File not found: wait.urp"


def test_the_operational_mode_is_set_and_cleared(console: Console) -> None:
    assert console.say("get operational mode") == "NONE"
    assert console.say("set operational mode AUTOMATIC") == "Operational mode AUTOMATIC is set"
    assert console.say("get operational mode") == "AUTOMATIC"
    assert console.say("set operational mode FAST") == "Failed setting operational mode: FAST"
    assert console.say("clear operational mode").startswith("No longer controlling the operational mode.")
    assert console.say("get operational mode") == "NONE"


def test_roles_are_those_of_cb3() -> None:
    console = Console(version=(3, 15))
    assert console.say("setUserRole LOCKED") == "Setting user role: LOCKED"
    assert console.say("getUserRole") == "LOCKED"
    assert console.say("setUserRole KING") == "Failed setting user role: KING"
    assert console.say("getUserRole") == "LOCKED"


@pytest.mark.parametrize(
    ("version", "line"),
    [((5, 25), "setUserRole NONE"), ((3, 15), "safetystatus"), ((5, 3), "safetystatus"), ((5, 7), "saveLog")],
)
def test_a_command_that_a_version_lacks_is_not_understood(version: tuple[int, int], line: str) -> None:
    assert Console(version=version).say(line) == f"could not understand: '{line}'"


def test_log_messages_and_reports_are_packed_into_a_support_file(console: Console, tmp_path: Path) -> None:
    assert (console.say("addToLog"), console.say("addToLog hello")) == ("No log message to add", "Added log message")
    assert console.say("saveLog") == "Log saved to disk"
    assert (tmp_path / "log_history.txt").read_text() == "hello\n"
    assert console.say("generate flight report system") == "Flight Report generated with id: 1"
    assert console.say("generate flight report ") == "Flight Report generated with id: 2"
    done, _, name = console.say("generate support file cell").partition(": ")
    assert done == "Completed successfully"
    with zipfile.ZipFile(tmp_path / name) as archive:
        assert archive.read("log_history.txt") == b"hello"
        assert b'"id": 2' in archive.read("flight_reports/2.json")
    assert console.say("generate support file .").startswith("Completed successfully: ur_2025")
    for folder in ("none", "../.."):
        assert console.say(f"generate support file {folder}").startswith(f"Error: {folder} is not a folder")


def test_local_control_refuses_what_acts_and_answers_questions() -> None:
    """The refusal's words, and that a connection of local control stays dead, are those of UR's ROS driver's issues."""
    assert Console().say("is in remote control") == "true"
    local = Console(remote_control=False)
    assert local.say("is in remote control") == "false"
    assert local.say("programState").startswith("STOPPED")
    for command in ("stop", "play", "load wait.urp", "power off", "brake release", "unlock protective stop"):
        assert local.say(command).startswith("Command is not allowed due to safety reasons")
    local.controller.switch_control(True)
    assert local.say("is in remote control") == "true"
    assert local.say("stop").startswith("Command is not allowed")
    assert Dashboard(local.interface).answer("stop") == "Stopped"
    ursim = Console(remote_enabled=False)
    assert (ursim.say("is in remote control"), ursim.say("stop")) == ("false", "Stopped")


def test_a_client_takes_its_leave(console: Console) -> None:
    assert not console.dashboard.left
    assert console.say("quit") == "Disconnected"
    assert console.dashboard.left


def test_windows_and_versions_are_answered(console: Console) -> None:
    assert console.say("popup look") == "showing popup"
    assert console.say("close popup") == "closing popup"
    assert console.say("close safety popup") == "closing safety popup"
    assert console.say("PolyscopeVersion") == "URSoftware 5.25.0.1 (Jan 01 2026)"
    assert console.say("version") == "5.25.0.1"
    assert console.say("loading") == "could not understand: 'loading'"


PAGE = ROOT / "docs" / "look-up" / "sim-ur.md"


def first_version(command: str, major: int) -> str:
    """The first version of a generation that has a command; empty where none has."""
    return next((f"{major}.{minor}" for minor in range(40) if available(command, (major, minor))), "")


def page_table() -> str:
    """The page's list of commands by the first versions of e-Series and of CB3 that have them."""
    groups: dict[tuple[str, str], list[str]] = {}
    for command in sorted(Console().dashboard._commands, key=str.lower):
        groups.setdefault((first_version(command, 5) or "-", first_version(command, 3) or "-"), []).append(command)
    lines = ["|e-Series since|CB3 since|dashboard commands|", "|---|---|---|"]
    lines += [f"|{new}|{old}|{', '.join(f'`{one}`' for one in groups[new, old])}|" for new, old in sorted(groups)]
    return "\n".join(lines)


def test_the_page_lists_every_command() -> None:
    text = PAGE.read_text(encoding="utf-8")
    shown = text.split("<!-- dashboard -->")[1].split("<!-- end of dashboard -->")[0]
    assert shown.strip() == page_table(), "python -m tests.robot.sim.ports.test_dashboard prints the table anew"


def test_every_command_of_the_page_is_understood_by_a_version_that_has_it() -> None:
    for version in ((5, 25), (3, 15)):
        for command in Console(version=version).dashboard._commands:
            said = Console(version=version).say(command)
            assert said.startswith("could not understand") is not available(command, version), (command, version, said)


if __name__ == "__main__":
    print(page_table())
