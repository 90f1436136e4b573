"""Parts of a guard at commits: state that changes, processes, threads, constants, keys of a scene.

    python -m bench parts [COMMIT ...]

An attribute counts where a method other than the constructor assigns it, in the guard, its stops and reactions, and in
the detector. A constant is a number with a name of its own in a module of guard, stop or driver process.
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

from bench.report import head, show

ROOT = Path(__file__).parents[2]
GUARD = ("robot/guard/", "robot/stop/", "robot/reaction/")
DETECTOR = ("skin/detection/",)
LIVE = (*GUARD, "robot/driver/", "robot/ur/", "src/coneskin/session/", "src/coneskin/core/", "src/coneskin/channel")
SCENE = ("src/coneskin/scene/", "src/coneskin/core/")


def git(*words: str) -> str:
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True).stdout


def sources(commit: str, rooms: tuple[str, ...]) -> list[str]:
    """Return the texts of the modules of rooms at a commit."""
    names = git("ls-tree", "-r", "--name-only", commit).splitlines()
    return [git("show", f"{commit}:{name}") for name in names if name.startswith(rooms) and name.endswith(".py")]


def changing(texts: list[str]) -> list[int]:
    """Return how many attributes change after construction, of each class in which any does."""
    found = []
    for item in (item for text in texts for item in ast.walk(ast.parse(text)) if isinstance(item, ast.ClassDef)):
        names = {
            node.attr
            for method in item.body
            if isinstance(method, ast.FunctionDef) and method.name not in ("__init__", "__post_init__")
            for node in ast.walk(method)
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
            if isinstance(node.value, ast.Name) and node.value.id == "self"
        }
        found += [len(names)] if names else []
    return found


def numbers(texts: list[str]) -> Iterator[str]:
    """Yield the names of modules' constants that are numbers."""
    for text in texts:
        for node in ast.parse(text).body:
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                target = node.targets[0] if isinstance(node, ast.Assign) else node.target
                leaves = [leaf for leaf in ast.walk(node.value) if isinstance(leaf, ast.Constant)]
                plain = isinstance(node.value, ast.Constant | ast.BinOp | ast.UnaryOp) and bool(leaves)
                plain = plain and all(isinstance(leaf.value, int | float) for leaf in leaves)
                if plain and isinstance(target, ast.Name) and target.id.isupper():
                    yield target.id


def parts(commit: str) -> dict[str, str]:
    guard, live = sources(commit, GUARD), sources(commit, LIVE)
    own, detector = changing(guard), changing(sources(commit, DETECTOR))
    texts = sources(commit, SCENE)
    return {
        "attributes that change, guard": f"{sum(own)} in {len(own)} classes",
        "attributes that change, with the detector": f"{sum(own + detector)} in {len(own + detector)} classes",
        "programs that run as processes": str(sum('__name__ == "__main__"' in text for text in live)),
        "places that start a thread": str(sum(len(re.findall(r"\bThread\(", text)) for text in live)),
        "constants of guard and stop": str(len(list(numbers(sources(commit, GUARD[:2]))))),
        "keys of a scene": str(sum(len(re.findall(r"\bKey\(", text)) for text in texts)),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="*", default=["f8cb2094", "HEAD"], help="(%(default)s)")
    commits = parser.parse_args().commits
    print(head())
    found = [parts(commit) for commit in commits]
    names = [git("rev-parse", "--short", commit).strip() for commit in commits]
    show("Parts of a guard", ["", *names], [[name, *(each[name] for each in found)] for name in found[0]])
