"""Odd arguments of the commands: usage, one line on stderr, or a result; never a traceback."""

import argparse
import importlib
import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.cli import COMMANDS, main

_VALUES = (
    "nan", "inf", "-inf", "-1", "0", "1e308", "1e-320", "x", "", "-", "1:2:3:4", "nan:nan:nan:nan:nan", "a=b", ".",
    "/dev/null", "/dev/zero", "/nonexistent/x", "\udcff", "wiring=open-A", "drop_every=0", "9" * 5000, "$", "%s", "54",
)  # fmt: skip
_ALWAYS = {"sim-skin": ["--duration-s", "0.01", "--rate-hz", "500", "--output", "/dev/null"]}


def _arguments(name: str, random: Random) -> list[str]:
    parser = argparse.ArgumentParser(add_help=False)
    importlib.import_module(COMMANDS[name][0]).add_arguments(parser)
    words = [name]
    for action in random.sample(parser._actions, random.randint(1, min(4, len(parser._actions)))):
        words += action.option_strings[-1:]
        count = 1 if action.nargs is None else action.nargs if isinstance(action.nargs, int) else random.randint(0, 2)
        words += [random.choice(_VALUES) for _ in range(count)]
    return words + _ALWAYS.get(name, [])


@settings(max_examples=150)
@given(seed=st.integers(0, 2**32))
@pytest.mark.parametrize(
    "name", ["unroll", *(pytest.param(command, marks=pytest.mark.long) for command in ("replay", "guard", "sim-skin"))]
)
def test_odd_arguments_never_give_a_traceback(tmp_path_factory: pytest.TempPathFactory, name: str, seed: int) -> None:
    words = _arguments(name, Random(seed))
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
        patch.chdir(tmp_path_factory.mktemp("empty"))  # the runs of other tests are no odd arguments
        try:
            code = main(words)
        except SystemExit as exc:  # argparse's, with the usage
            code = int(str(exc.code))
    assert code in (0, 1, 2), words
    assert code == 0 or f"coneskin {name}" in said.getvalue() or "usage: " in said.getvalue()


def test_the_paths_of_commands_may_be_anything(tmp_path: Path) -> None:
    for name in ("replay", "guard"):
        for path in ("/dev/zero", str(tmp_path), str(tmp_path / "none"), "x" * 5000):
            with redirect_stderr(io.StringIO()) as said:
                assert main([name, path]) == 1
            assert said.getvalue().startswith(f"coneskin {name}: ")
