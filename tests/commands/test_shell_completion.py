"""Completion in a shell: what a shell is told when it asks as argcomplete's code does."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from coneskin.cli import main


def ask(line: str, tmp_path: Path) -> set[str]:
    """The words that are offered at the end of a line."""
    answer = tmp_path / "answer"
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_STDOUT_FILENAME": str(answer), "COMP_LINE": line}
    asked |= {"COMP_POINT": str(len(line)), "COMP_TYPE": "9", "_ARGCOMPLETE_IFS": "\n"}
    done = subprocess.run(
        [sys.executable, "-m", "coneskin"], env={**os.environ, **asked}, capture_output=True, text=True, timeout=60
    )
    assert done.stdout == ""
    return {word.strip() for word in answer.read_text().split("\n")}


def test_commands_and_the_options_of_the_one_that_was_typed_are_offered(tmp_path: Path) -> None:
    assert ask("coneskin d", tmp_path) == {"demo", "design", "doctor"}
    offered = ask("coneskin guard scene.toml --", tmp_path)
    assert {"--once", "--publish", "--simulated", "--duration-s"} <= offered
    assert "--no-touches" not in offered
    assert ask("coneskin unroll --wrap", tmp_path) == {"--wrap-deg"}


@pytest.mark.skipif(sys.platform == "win32", reason="there is no head")
def test_a_reader_that_goes_is_no_traceback() -> None:
    pytest.importorskip("argcomplete")
    words = [sys.executable, "-m", "coneskin", "--completion", "bash"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as asked:
        assert asked.stdout is not None
        assert asked.stderr is not None
        asked.stdout.close()
        assert asked.stderr.read() == ""
    assert asked.returncode == 1


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_the_code_of_each_shell_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--completion", shell]) == 0
    assert "coneskin" in capsys.readouterr().out


def test_without_the_package_its_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "argcomplete.shell_integration", None)
    assert main(["--completion", "bash"]) == 1
    assert "pip install 'coneskin[completion]'" in capsys.readouterr().err
