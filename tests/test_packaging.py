"""What is given to a system: the unit is verified by systemd, the rules and the image name what is there."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from coneskin.commands import guard
from tests.support.paths import ROOT

FOLDER = ROOT / "packaging"
UNIT = FOLDER / "coneskin@.service"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd-analyze")
def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    made = tmp_path / "coneskin@cell.service"
    made.write_text(UNIT.read_text())
    done = subprocess.run(["systemd-analyze", "verify", str(made)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "coneskin@cell.service:" not in done.stderr, "systemd ignores a line of it"


def test_the_unit_runs_a_command_that_there_is_and_never_again_by_itself() -> None:
    text = UNIT.read_text()
    assert "Restart=no" in text
    (words,) = re.findall(r"coneskin guard (\S+) (--\S+) udp://127\.0\.0\.1:9870", text)
    assert words == ("/var/lib/coneskin/%i.toml", "--publish")
    assert '"--publish"' in Path(guard.__file__).read_text()


def test_each_udev_rule_is_a_list_of_matches_and_assignments() -> None:
    rules = [line for line in (FOLDER / "99-coneskin.rules").read_text().splitlines() if not line.startswith("#")]
    part = r'[A-Z]+(\{\w+\})?(==|=|\+=)"[^"]*"'
    assert len(rules) == 3
    assert all(re.fullmatch(rf"{part}(, {part})*", rule) for rule in rules)
    assert any('ATTR{latency_timer}="1"' in rule and "ftdi_sio" in rule for rule in rules)


def test_the_image_installs_extras_that_there_are() -> None:
    (extras,) = re.findall(r"'/src\[([\w,]+)\]'", (FOLDER / "Dockerfile").read_text())
    project = (FOLDER.parent / "pyproject.toml").read_text()
    assert all(re.search(rf"^{extra} = \[", project, re.MULTILINE) for extra in extras.split(","))
