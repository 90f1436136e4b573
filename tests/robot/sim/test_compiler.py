"""The translator of the simulated controller: a process of its own, which may die and is then started again."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from coneskin.robot.sim import compiler
from coneskin.robot.sim.compiler import _IN_PLACE_LENGTH, Compiler, Result
from coneskin.robot.sim.urscript.translator import Translation
from coneskin.robot.sim.urscript.values import ScriptError

LONG = "def long():\n" + "  sync()\n" * (_IN_PLACE_LENGTH // 8) + "end\n"


@pytest.fixture
def translator() -> Iterator[Compiler]:
    with Compiler() as made:
        yield made


def result(translator: Compiler) -> Result:
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        if found := translator.results():
            return found[0]
        time.sleep(0.001)
    raise AssertionError("no translation")


def test_a_long_program_is_translated_and_its_error_has_its_line(translator: Compiler) -> None:
    translator.submit(1, LONG)
    number, made = result(translator)
    assert number == 1
    assert isinstance(made, Translation)
    translator.submit(2, LONG.replace("end", "  explode()\nend"))
    _, problem = result(translator)
    assert isinstance(problem, ScriptError)
    assert problem.line == _IN_PLACE_LENGTH // 8 + 2


@pytest.mark.long
def test_a_translator_that_hangs_is_ended_and_another_started(
    translator: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    translator.submit(1, LONG)
    result(translator)
    monkeypatch.setattr(compiler, "_TRANSLATION_TIME", 1e-9)
    translator.submit(2, LONG + " ")
    number, problem = result(translator)
    assert (number, isinstance(problem, ScriptError)) == (2, True)
    assert "took more than" in str(problem)
    monkeypatch.undo()
    translator.submit(3, LONG + "  ")
    number, made = result(translator)
    assert (number, isinstance(made, Translation)) == (3, True)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux bounds the memory of a process")
def test_a_process_with_a_bound_gets_no_more_memory_than_that() -> None:
    code = (
        "from coneskin.robot.sim.compiler import bounded_memory\n"
        "with bounded_memory(50 * 2**20) as bounded:\n"
        "  try:\n    bytes(100 * 2**20)\n  except MemoryError:\n    print(bounded)\n"
        "print(len(bytes(100 * 2**20)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert done.stdout.split() == ["True", str(100 * 2**20)]
