"""The public face: every name is there, typed, documented in README, and loads nothing before it is asked for."""

import ast
import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import coneskin as cs
from coneskin.core import errors
from tests.support.paths import ROOT

NAMES = sorted(set(cs.__all__) - {"__version__"})


def typed_imports() -> dict[str, str]:
    """Name -> module of the imports that only a type checker sees."""
    tree = ast.parse((ROOT / "src" / "coneskin" / "__init__.py").read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    found = {}
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            assert alias.asname == alias.name, "a re-export names itself, or strict checkers hide it"
            found[alias.name] = str(node.module)
    return found


def test_a_type_checker_sees_the_names_that_a_program_sees() -> None:
    assert typed_imports() == cs._HOMES


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_is_documented_where_it_lives(name: str) -> None:
    thing = getattr(cs, name)
    home = importlib.import_module(f"coneskin.{cs._HOMES[name]}")
    assert thing is getattr(home, name)
    assert inspect.getdoc(thing)
    assert name in dir(cs)


def test_the_whole_tree_of_errors_is_public() -> None:
    kinds = {name: kind for name, kind in vars(errors).items() if isinstance(kind, type)}
    tree = {name for name, kind in kinds.items() if issubclass(kind, errors.ConeSkinError)}
    assert len(tree) > 10
    assert tree <= set(NAMES)


def test_no_public_name_hides_a_folder() -> None:
    folders = {path.name for path in (ROOT / "src" / "coneskin").iterdir() if path.is_dir()}
    modules = {path.stem for path in (ROOT / "src" / "coneskin").glob("*.py")}
    assert not set(NAMES) & (folders | modules)


def test_the_page_lists_every_public_name_and_no_other() -> None:
    text = (ROOT / "docs" / "look-up" / "public-names.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"`(\w+)`", text.split("|---|---|")[1])) == NAMES


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        cs.nonsense  # noqa: B018


def test_importing_the_package_loads_none_of_it() -> None:
    code = "import sys, coneskin; print(*[name for name in sys.modules if name.startswith('coneskin.')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("path", sorted((ROOT / "demos").glob("*.py")), ids=lambda path: path.name)
def test_a_demo_imports_nothing_of_ours_but_the_face(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    ours = [
        name
        for node in ast.walk(tree)
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [str(node.module)]
            if isinstance(node, ast.ImportFrom)
            else []
        )
        if name.split(".")[0] == "coneskin"
    ]
    assert ours == ["coneskin"]
