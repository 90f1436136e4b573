"""The arm under the names of ur_rtde: every public method of the wheel is there or refused."""

import ast
import importlib.util
import inspect
import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock, call

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.ur.ur_rtde import QUESTION_WORDS
from coneskin.session.ur_rtde_names import NAMES, REFUSALS, UrRtdeArm
from tests.support.paths import ROOT

ELSEWHERE = {"unlockProtectiveStop"}  # of the dashboard client


@pytest.fixture(scope="module")
def wheel():
    pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")
    spec = importlib.util.spec_from_file_location("reference", ROOT / "scripts" / "reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name for names in module.wheel_methods().values() for name in names}


@pytest.fixture
def arm():
    return UrRtdeArm(None, lambda stopped: None, arm_model("UR5e"), "nowhere")


def test_every_public_method_of_the_wheel_is_there_or_refused_and_nothing_else_is(wheel) -> None:
    assert len(wheel) > 120
    assert not NAMES.keys() & REFUSALS.keys()
    assert NAMES.keys() | REFUSALS.keys() == wheel | ELSEWHERE


def test_arguments_have_the_wheel_s_names(wheel) -> None:
    """And its defaults, as far as the wheel names them; a question hands on what it gets."""
    import rtde_control

    compared = 0
    for name in set(NAMES) - set(QUESTION_WORDS):
        for signature in re.findall(
            rf"\b{name}\(self[^,)]*, (.*?)\) ->", getattr(rtde_control.RTDEControlInterface, name, str).__doc__
        ):
            wheel = re.findall(r"(\w+): ", signature)
            if any(word.startswith("arg") for word in wheel) or wheel[0] == "path":
                continue
            ours = dict(list(inspect.signature(NAMES[name].call).parameters.items())[1:])
            assert list(ours)[: len(wheel)] == wheel, name
            for argument, value in re.findall(r"(\w+): \w+ = ([^,]+)", signature):
                assert ours[argument].default == ast.literal_eval(value), (name, argument)
            compared += 1
    assert compared >= 10


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refused_method_says_why_and_what_to_do(arm, name) -> None:
    method = getattr(arm, name)
    with pytest.raises(RobotRefused, match=rf"{name} is refused: \w") as refused:
        method([0.0] * 6, 1, asynchronous=True)
    assert str(refused.value).endswith(REFUSALS[name])


def test_a_name_that_neither_has_is_an_attribute_error(arm) -> None:
    with pytest.raises(AttributeError, match="the arm has no 'moveK', nor has ur_rtde"):
        arm.moveK()
    assert not hasattr(arm, "__fspath__")


def test_what_a_method_is_called_here_exists(arm) -> None:
    for method in NAMES.values():
        for word in re.findall(r"^(\w+)|, (\w+)", method.own):
            own = word[0] or word[1]
            assert own == "time" or own in dir(UrRtdeArm), method


@pytest.mark.parametrize(("name", "own"), [("moveJ", "move_j"), ("moveL", "move_l")])
def test_a_list_of_lists_is_a_path_and_a_move_waits_unless_it_is_told_not_to(name, own) -> None:
    arm, point, make = Mock(), [0.1] * 6, getattr(Waypoint, own)
    method = NAMES[name].call
    method(arm, point, 0.5, 2.0)
    method(arm, point, 0.5, 2.0, True)
    method(arm, [[*point, 0.5, 2.0, 0.02]])
    method(arm, [[*point, 0.5, 2.0, 0.0]], True)
    move = getattr(call, own)
    assert arm.mock_calls == [
        move(point, 0.5, 2.0, wait=True),
        move(point, 0.5, 2.0, wait=False),
        call.move_path([make(point, 0.5, 2.0, 0.02)], wait=True),
        call.move_path([make(point, 0.5, 2.0, 0.0)], wait=False),
    ]


@pytest.mark.long
def test_a_type_checker_knows_what_each_method_takes_and_which_are_refused(tmp_path: Path) -> None:
    """mypy, strictly, on a program as docs/do/ur-rtde.md converts one."""
    program = tmp_path / "program.py"
    program.write_text(
        'import coneskin as cs\n\ncontrol = cs.guard("scene.toml").open().arm\n'
        "control.moveJ([*control.getActualQ()], 1.0, 1.4)\ncontrol.moveL([[0.0] * 9], True)\n"
        "running: bool = control.getAsyncOperationProgressEx().isAsyncOperationRunning()\n"
        "control.moveX([0.0] * 6)\ncontrol.moveL(3)\ncontrol.forceMode()\n"
    )
    done = subprocess.run([sys.executable, "-m", "mypy", str(program)], cwd=ROOT, capture_output=True, text=True)
    assert re.findall(r"program\.py:(\d+): error: .*\[(.*)\]", done.stdout) == [
        ("7", "attr-defined"),
        ("8", "call-overload"),
        ("9", "deprecated"),
    ], done.stdout + done.stderr
