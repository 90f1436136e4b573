"""Mutation campaign: random changes of the product, and which of them the tests of its room do not notice.

    python -m bench mutations --keep FILE                  # 200 mutants, two at a time; goes on where FILE ends
    python -m bench mutations --count 4 --keep FILE --short

A mutant is a file of geometry, skin, robot or src/coneskin with one comparison, operator, condition or number changed
(mutants.py). It runs against the tests of its room, in a copy of the tree: test_<module>.py, the other tests of the
folder that mirrors its own, and those that import the module. First the short tests; where it survives these, the
long ones.
A mutant that the tests do not end in time counts as noticed. A test that fails with a mutant is run again without it,
and is left out where it fails then too.
The exit code is 1 where more than --most percent survive.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench.report import head, show

from .mutants import Mutant, draw

_TREE_ROOT = Path(__file__).parents[2]
_PRODUCT_ROOMS = ("geometry", "skin", "robot", "src/coneskin")
_SHORT, _LONG = "not long", "long"  # marker expressions
#: exit code of pytest -> verdict; 2: a file could not be collected, 5: no test was selected
_VERDICTS = {0: "passed", 1: "failed", 2: "failed", 5: "passed", None: "timeout"}
_TIMEOUTS = {_SHORT: 300.0, _LONG: 900.0}  # s, of the tests of a room


def product(root: Path) -> list[str]:
    """Return the files that are changed: all of the product but what users test with."""
    files = _listed(root, *(f"{room}/*.py" for room in _PRODUCT_ROOMS))
    return [file for file in files if not file.startswith("src/coneskin/testing/") and "__main__" not in file]


def imports_of(root: Path) -> dict[str, set[str]]:
    """Return which test files import a module: name -> files."""
    found: dict[str, set[str]] = {}
    for file in _listed(root, "tests/test_*.py", "tests/**/test_*.py"):
        for node in ast.walk(ast.parse((root / file).read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            for name in names:
                found.setdefault(name, set()).add(file)
    return found


def tests_of(root: Path, file: str, importers: dict[str, set[str]]) -> list[str]:
    """Return the tests of a product file, the nearest first."""
    path = Path(file.removeprefix("src/coneskin/"))
    module = ".".join(["coneskin", *path.with_suffix("").parts]).removesuffix(".__init__")
    folder = Path("tests") / path.parent
    while not any((root / folder).glob("**/test_*.py")):
        folder = folder.parent
    near = folder / f"test_{path.stem}.py"
    room = [] if folder == Path("tests") else sorted((root / folder).glob("test_*.py")) or [root / folder]
    nearest = [str(each.relative_to(root)) for each in sorted(room, key=lambda each: each.name != near.name)]
    nearest = nearest or ([str(near)] if (root / near).exists() else [])
    return [*nearest, *sorted(importers.get(module, set()) - set(nearest))]


class Tree:
    """Copy of the working tree in which one mutant at a time is tried.

    Args:
        folder: where the copy goes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        files = "\0".join(file for file in _listed(_TREE_ROOT, "*") if (_TREE_ROOT / file).exists())
        copy = ["cp", "--parents", "--no-dereference", "--target-directory", str(folder)]
        subprocess.run(["xargs", "-0", *copy], cwd=_TREE_ROOT, input=files, text=True, check=True)
        self._clock = int(time.time())

    def write(self, file: str, source: bytes) -> None:
        """Write a file with a time of its own, so that no compiled one of before counts."""
        self._clock += 1
        (self.folder / file).write_bytes(source)
        os.utime(self.folder / file, (self._clock, self._clock))

    def run(self, tests: Sequence[str], marker: str, timeout: float) -> tuple[str, str]:
        """Run tests until one fails; return the verdict, and the name of that which failed."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", marker, *tests]
        environment = {**os.environ, "PYTHONPATH": str(self.folder / "src")}
        with tempfile.TemporaryFile("w+") as said:
            child = subprocess.Popen(
                command, cwd=self.folder, env=environment, stdout=said, stderr=said, start_new_session=True
            )
            try:
                code = child.wait(timeout)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                _end_group(child)
            said.seek(0)
            names = (line.partition(" ")[2] for line in said if line.startswith(("FAILED ", "ERROR ")))
            failed = next(names, "").partition(" - ")[0].strip()
        return _VERDICTS.get(code, "broken"), failed


class Campaign:
    """Mutants, tried by workers that each have a tree.

    Args:
        trees: idle trees, one for each worker.
        markers: of the tests that are tried, one after the other.
    """

    def __init__(self, trees: queue.Queue[Tree], markers: tuple[str, ...]) -> None:
        self._trees = trees
        self._markers = markers
        self._importers = imports_of(_TREE_ROOT)
        self._failing: dict[str, bool] = {}  # test -> whether it fails on the copy as it is

    def judge(self, number: int, mutant: Mutant) -> dict[str, Any]:
        """Try a mutant; return its row."""
        tests = tests_of(_TREE_ROOT, mutant.file, self._importers)
        row = {"number": number, "file": mutant.file, "line": mutant.line, "kind": mutant.kind}
        row |= {"before": mutant.before, "after": mutant.after, "tests": tests, "verdict": "survived", "by": ""}
        tree = self._trees.get()
        source = (tree.folder / mutant.file).read_bytes()
        try:
            for marker in self._markers:
                while True:
                    options = [f"--deselect={name}" for name, fails in self._failing.copy().items() if fails]
                    tree.write(mutant.file, mutant.apply(source))
                    verdict, failed = tree.run([*options, *tests], marker, _TIMEOUTS[marker])
                    tree.write(mutant.file, source)
                    if verdict != "failed" or not self._fails_anyway(tree, failed):
                        break
                if verdict != "passed":
                    return row | {"verdict": f"{verdict}, {marker}", "by": failed}
            return row
        finally:
            tree.write(mutant.file, source)
            self._trees.put(tree)

    def _fails_anyway(self, tree: Tree, test: str) -> bool:
        """Return whether a test fails on the copy as it is, too."""
        if test and test not in self._failing:
            self._failing[test] = tree.run([test], "", _TIMEOUTS[_LONG])[0] == "failed"
        return bool(test) and self._failing[test]


def _listed(root: Path, *patterns: str) -> list[str]:
    command = ["git", "-C", str(root), "ls-files", "-z", "--", *patterns]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split("\0")[:-1]


def _end_group(child: subprocess.Popen[bytes]) -> None:
    """End a child and the processes that it has left behind."""
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, help="mutants (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="(%(default)s)")
    parser.add_argument("--parallel", type=int, default=2, help="workers (%(default)s)")
    parser.add_argument("--short", action="store_true", help="try the short tests only")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each row to this file; go on from it")
    parser.add_argument("--most", type=float, default=25.0, help="percentage that may survive (%(default)s)")
    parser.add_argument("--list", action="store_true", help="print the mutants, and try none")
    args = parser.parse_args()
    files = product(_TREE_ROOT)
    mutants = {number: draw(_TREE_ROOT, files, f"{args.seed} {number}") for number in range(args.count)}
    if args.list:
        for number, each in mutants.items():
            print(f"{number:4d}  {each.file}:{each.line}  {each.kind}: {each.before!r} -> {each.after!r}")
        return 0
    rows = _kept(args.keep, mutants)
    with tempfile.TemporaryDirectory(prefix="coneskin-mutations-") as folder, ThreadPoolExecutor(args.parallel) as pool:
        trees: queue.Queue[Tree] = queue.Queue()
        for number in range(args.parallel):
            place = Path(folder) / str(number)
            place.mkdir()
            trees.put(Tree(place))
        campaign = Campaign(trees, (_SHORT,) if args.short else (_SHORT, _LONG))
        left = [pool.submit(campaign.judge, n, each) for n, each in mutants.items() if n not in rows]
        for done in as_completed(left):
            row = done.result()
            rows[row["number"]] = row
            print(f"{len(rows)} of {args.count}: {row['verdict']}: {row['file']}:{row['line']}", file=sys.stderr)
            if args.keep:
                with args.keep.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    return _report(args.seed, list(rows.values()), args.most)


def _kept(file: Path | None, mutants: dict[int, Mutant]) -> dict[int, dict[str, Any]]:
    """Return the rows of an earlier run that are of the same mutants."""
    lines = file.read_text(encoding="utf-8").splitlines() if file and file.exists() else []
    rows = {}
    for row in map(json.loads, lines):
        same = mutants.get(row["number"])
        if same and (same.file, same.line, same.before) == (row["file"], row["line"], row["before"]):
            rows[row["number"]] = row
    return rows


def _report(seed: int, rows: list[dict[str, Any]], most: float) -> int:
    print(f"{head()}\nseed {seed}")
    survivors = [row for row in rows if row["verdict"] == "survived"]
    share = 100.0 * len(survivors) / max(1, len(rows))
    show(f"mutants of seed {seed}", ["mutants", "survived", "share"], [[len(rows), len(survivors), f"{share:.1f} %"]])
    verdicts = sorted(Counter(row["verdict"] for row in rows).items())
    show("verdicts: by which tests a mutant was noticed", ["verdict", "mutants"], [list(each) for each in verdicts])
    kinds = sorted({row["kind"] for row in rows})
    counts = [[k, sum(r["kind"] == k for r in rows), sum(r["kind"] == k for r in survivors)] for k in kinds]
    show("kinds", ["kind", "mutants", "survived"], counts)
    places = [[f"{r['file']}:{r['line']}", _word(r["before"]), _word(r["after"])] for r in survivors]
    show("survivors", ["place", "before", "after"], sorted(places))
    return int(share > most)


def _word(text: str) -> str:
    return " ".join(text.split())
