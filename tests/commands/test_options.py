"""Options of all commands: the default that a help tells is the one that counts, and the choices are those it names."""

import argparse
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.cli import COMMANDS


def actions_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from actions_of(below)
        yield action


def options_of(command: str) -> list[argparse.Action]:
    parser = argparse.ArgumentParser()
    importlib.import_module(COMMANDS[command][0]).add_arguments(parser)
    return list(actions_of(parser))


def test_the_default_that_a_help_tells_is_the_one_that_counts() -> None:
    told = 0  # "all" stands for a list of choices
    for command in COMMANDS:
        for action in options_of(command):
            found = re.search(r"\((?:default:? )?([\d.]+)\)$", action.help or "")
            if isinstance(action.default, str | Path):
                found = re.search(r"\(default:? ([\w/]+)\)$", action.help or "")
            if found and found[1] != "all" and action.default is not None:
                assert type(action.default)(found[1]) == action.default, (command, action.dest)
                told += 1
    assert told >= 22


@pytest.mark.parametrize(
    ("command", "name", "choices"),
    [("calibrate", "marks", (4, 9, 16)), ("sim-skin", "frame_length", (36, 40, 52))],  # as docs/look-up has them
)
def test_the_choices_are_those_that_there_are(command: str, name: str, choices: tuple[int, ...]) -> None:
    assert [tuple(action.choices) for action in options_of(command) if action.dest == name] == [choices]
