"""README and the pages in docs/: every code block runs or says why not, and what the pages name exists.

Each page has a folder of its own in which its blocks run from the first to the last:

    ```python                     in a fresh interpreter
    ```sh                         each command; the exit code must be 0, or what "# exit code N" says
    ```toml title="scene.toml"    is saved under that name; a scene is parsed
    ```text                       is only shown

A command that ends with "&" runs until the end of its page. Loopback addresses are replaced by free ones, and the
silences that a scene allows become as long as possible: a busy machine is no failure.
"""

import importlib.util
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from coneskin.robot.sim.process import free_host
from coneskin.scene.reader import parse_scene
from tests.support.paths import ROOT

PAGES = {
    path.relative_to(ROOT).as_posix(): path
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
}
#: pages whose blocks compute for seconds
LONG = {f"docs/{name}.md" for name in ("understand/field", "do/design", "do/permissible-speed", "do/runs")}
#: pages whose blocks guard an arm, and need a share of the computer
LIVE = {"README.md", "docs/look-up/sim-ur.md"}
LIVE |= {f"docs/do/{name}.md" for name in ("calibrate", "commission", "guard-external", "guard-internal", "impact")}
LIVE |= {f"docs/do/{name}.md" for name in ("replay", "ur-controller")}
MARKS = {**dict.fromkeys(LONG, (pytest.mark.long,)), **dict.fromkeys(LIVE, (pytest.mark.long, pytest.mark.processes))}
#: blocks that no test runs, each with its reason in the page
NOT_RUN = 3
specification = importlib.util.spec_from_file_location("reference", ROOT / "scripts" / "reference.py")
assert specification is not None
assert specification.loader is not None
reference = importlib.util.module_from_spec(specification)
specification.loader.exec_module(reference)

LANGUAGES = ("python", "sh", "toml", "text")
TIMEOUT = 180.0  # s for one block; a busy machine takes ten times as long as an idle one
SHELL = 'coneskin() { "$PYTHON" -c "$COMMAND" "$@"; }; python() { "$PYTHON" "$@"; };'
#: ``python -m coneskin`` in a hurry: permissible speeds of one mass, roughly, and designs without
#: pictures, which ``tests/commands`` looks at
COMMAND = """
import math, sys
from coneskin.cli import main
if sys.argv[1] == "permissible":
    from coneskin.impact.permissible_speed import speed_map
    assert math.inf in speed_map._CURVE_MASSES and speed_map._SPEED_TOLERANCE < 0.1 and speed_map._POSITION_COUNT > 30
    speed_map._CURVE_MASSES, speed_map._SPEED_TOLERANCE, speed_map._POSITION_COUNT = (math.inf,), 0.1, 30
elif sys.argv[1] == "design":
    sys.argv.append("--no-pictures")
sys.exit(main())
"""


class Block(NamedTuple):
    """One fenced block of a page."""

    language: str
    title: str
    line: int
    text: str
    not_run: str


def blocks(path: Path) -> Iterator[Block]:
    """The fenced blocks of a page, in order."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start: int | None = None
    language = title = reason = ""
    for number, line in enumerate(lines):
        if not line.startswith("```"):
            continue
        if start is None:
            start = number
            language, _, rest = line[3:].partition(" ")
            title = match[1] if (match := re.fullmatch(r'title="(.+)"', rest)) else ""
            before = lines[number - 1] if number else ""
            reason = match[1] if (match := re.fullmatch(r"<!-- not run: (.+) -->", before)) else ""
        else:
            yield Block(language, title, start + 1, "\n".join(lines[start + 1 : number]) + "\n", reason)
            start = None
    assert start is None, f"{path.name}:{start} opens a block that nothing closes"


def commands(text: str) -> Iterator[tuple[str, int]]:
    """Each command of a shell block, which may go over several lines, and the exit code that is expected."""
    command = ""
    for line in text.splitlines():
        command += line
        try:
            words = shlex.split(command, comments=True)
        except ValueError:  # a quotation is open
            command += "\n"
            continue
        if command.endswith("\\"):
            command += "\n"
            continue
        if words:
            match = re.search(r"# exit code (\d+)", command)
            yield command, int(match[1]) if match else 0
        command = ""
    assert not command, f"a command does not end: {command}"


def tube(path: Path, radius: float, start: float, end: float) -> None:
    """Write the mesh of a tube about z, with both ends closed, as ASCII STL [m]."""
    count = 96
    angles = [2.0 * math.pi * k / count for k in range(count)]
    corners = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
    facets = []
    for (x1, y1), (x2, y2) in zip(corners, corners[1:] + corners[:1], strict=True):
        low1, low2, high1, high2 = (x1, y1, start), (x2, y2, start), (x1, y1, end), (x2, y2, end)
        bottom, top = (0.0, 0.0, start), (0.0, 0.0, end)
        facets += [(low1, low2, high2), (low1, high2, high1), (bottom, low2, low1), (top, high1, high2)]
    lines = ["solid tube"]
    for facet in facets:
        loop = "".join(f"vertex {x:.9f} {y:.9f} {z:.9f}\n" for x, y, z in facet)
        lines.append(f"facet normal 0 0 0\nouter loop\n{loop}endloop\nendfacet")
    path.write_text("\n".join([*lines, "endsolid tube\n"]), encoding="ascii")


#: file that a page may name without making it -> radius, start and end of the tube that stands for it [m]
READERS_FILES = {"upperarm.stl": (0.054, 0.0, 0.434), "forearm.stl": (0.0375, 0.08, 0.36)}


class PageRun:
    """Folder of one page, and what runs in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._hosts: dict[str, str] = {}
        self._running: list[tuple[str, subprocess.Popen[str]]] = []

    def adapt(self, text: str) -> str:
        """Make the readers' files, and replace loopback addresses."""
        for name, sizes in READERS_FILES.items():
            if name in text and not (self.folder / name).exists():
                tube(self.folder / name, *sizes)
        text = re.sub(r"coneskin sim-ur(?! --h)", "coneskin sim-ur --host 127.0.0.1", text)
        text = re.sub(r"\b(skin_silence_ms|arm_silence_ms) = \d+", r"\1 = 1000", text)
        return re.sub(r"127\.0\.0\.\d+", lambda match: self._host(match[0]), text)

    def _host(self, shown: str) -> str:
        return self._hosts.setdefault(shown, free_host(used=self._hosts.values()))

    def python(self, block: Block) -> None:
        script = self.folder / f"line_{block.line}.py"
        script.write_text(self.adapt(block.text), encoding="utf-8")
        self._finish([sys.executable, "-W", "error", script.name], 0, block.line)

    def shell(self, block: Block) -> None:
        for command, code in commands(self.adapt(block.text)):
            if command.rstrip().endswith("&"):
                self._start(command.rstrip()[:-1], block.line)
            else:
                self._finish(["bash", "-c", f"{SHELL} {command}"], code, block.line)

    def toml(self, block: Block) -> None:
        text = self.adapt(block.text)
        if block.title:
            self.save(block)
        if "link" in tomllib.loads(text):
            parse_scene(text, block.title or f"line {block.line}", self.folder)

    def save(self, block: Block) -> None:
        (self.folder / block.title).write_text(self.adapt(block.text), encoding="utf-8")

    @property
    def _environment(self) -> dict[str, str]:
        return {**os.environ, "PYTHON": sys.executable, "COMMAND": COMMAND, "MPLBACKEND": "Agg"}

    def _start(self, command: str, line: int) -> None:
        """Start a command that runs until the end of the page, and wait until it says that it is ready."""
        words = [sys.executable, "-m", *shlex.split(command)]
        child = subprocess.Popen(words, cwd=self.folder, env=self._environment, stdout=subprocess.PIPE, text=True)
        self._running.append((command, child))
        assert child.stdout is not None
        assert child.stdout.readline(), f"line {line}: it ends at once: {command}"

    def _finish(self, words: list[str], code: int, line: int) -> None:
        for _ in range(5):  # a command may say that this computer is too busy for it
            done = subprocess.run(
                words,
                cwd=self.folder,
                env=self._environment,
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
                stdin=subprocess.DEVNULL,
            )
            if done.returncode == code or "busy" not in done.stderr:
                break
        said = f"exit code {done.returncode} of {words[-1]}\n{done.stdout}{done.stderr}"
        assert done.returncode == code, f"line {line}: {said}"

    def close(self) -> None:
        """End what runs in the background as Ctrl-C does, and see that it ends well."""
        codes = {}
        for _, child in self._running:
            child.send_signal(signal.SIGINT)
        for command, child in self._running:
            try:
                child.communicate(timeout=TIMEOUT)
            except subprocess.TimeoutExpired:
                child.kill()
                child.communicate()
            codes[command] = child.returncode
        assert set(codes.values()) <= {0}, codes


@pytest.fixture
def page_run(tmp_path: Path) -> Iterator[PageRun]:
    run = PageRun(tmp_path)
    yield run
    run.close()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs pseudo-terminals and loopback addresses")
@pytest.mark.parametrize(  # the tutorial runs as its notebook, in test_notebook
    "page",
    [pytest.param(p, marks=MARKS.get(p, ())) for p in PAGES if "first-collision" not in p],
)
def test_the_blocks_of_a_page_run(page: str, page_run: PageRun) -> None:
    for block in blocks(PAGES[page]):
        if block.title:  # a command may stand above the file that it reads
            page_run.save(block)
    for block in blocks(PAGES[page]):
        if block.not_run or block.language == "text":
            continue
        {"python": page_run.python, "sh": page_run.shell, "toml": page_run.toml}[block.language](block)


def test_every_block_runs_or_says_why_not() -> None:
    found = [(page, block) for page, path in PAGES.items() for block in blocks(path)]
    others = [f"{page}:{block.line}" for page, block in found if block.language not in LANGUAGES]
    assert others == []
    left_out = [f"{page}:{block.line}: {block.not_run}" for page, block in found if block.not_run]
    runs = sum(block.language != "text" for _, block in found) - len(left_out)
    print(f"{runs} blocks run, {len(left_out)} do not:", *left_out, sep="\n")
    assert len(left_out) == NOT_RUN, left_out


def test_a_block_that_fails_is_seen(page_run: PageRun) -> None:
    """Otherwise the tests above could not fail."""
    with pytest.raises(AssertionError, match="exit code 1"):
        page_run.python(Block("python", "", 1, "assert False\n", ""))
    with pytest.raises(AssertionError, match="exit code 2"):
        page_run.shell(Block("sh", "", 1, "coneskin nonsense\n", ""))
    assert list(commands('a \\\n b # exit code 3\n# a remark\npython -c "\nx"\n')) == [
        ("a \\\n b # exit code 3", 3),
        ('python -c "\nx"', 0),
    ]


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES)
def test_the_files_that_a_page_names_exist(page: str) -> None:
    """Names of modules in code font, and paths that begin with a folder of the repository."""
    text = re.sub(r"^```.*?^```$", "", PAGES[page].read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    folders = ("geometry", "skin", "robot", "src", "tests", "demos", "bench", "docs", "scripts")
    named = set(re.findall(rf"`((?:{'|'.join(folders)})/[\w./-]+\.\w+)`", text))
    planned = {"skin/sources/i2c_bus.py"}  # the example of docs/extend/sensor-bus.md
    assert sorted(name for name in named - planned if not (ROOT / name).is_file()) == []
    modules = {path.name for folder in folders for path in (ROOT / folder).rglob("*.py")}
    assert set(re.findall(r"`(\w+\.py)`", text)) - modules == set()


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_the_links_of_a_page_at_the_root_lead_somewhere(page: str) -> None:
    """The links in docs/ are checked by mkdocs."""
    text = (ROOT / page).read_text(encoding="utf-8")
    targets = set(re.findall(r"\]\(([^)#]+)[^)]*\)", text))
    assert sorted(name for name in targets if "://" not in name and not (ROOT / name).exists()) == []


@pytest.mark.long
def test_the_tables_to_look_up_are_what_the_script_makes() -> None:
    done = subprocess.run(
        [sys.executable, "scripts/reference.py", "--check"], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_every_promise_has_a_test_and_every_id_is_a_promise() -> None:
    promises, proofs = reference.promises(), reference.proofs()
    print(f"{len(promises)} promises, {sum(map(len, proofs.values()))} proofs")
    assert list(promises) == [f"P{number:02d}" for number in range(1, len(promises) + 1)]
    assert promises.keys() == proofs.keys()


def plain(text: str) -> str:
    """Prose of a page: neither blocks, formulas, code, tables, headings, nor what is said of pictures."""
    text = re.sub(r"```.*?```|<!--.*?-->|!\[.*?\]\(.*?\)", "\n\n", text, flags=re.DOTALL)
    text = re.sub(r"^\s*\|.*$|^#.*$|^ {4,}\S*[ =].* (=|[0-9A-F]{2}) .*$", "\n\n", text, flags=re.MULTILINE)
    return re.sub(r"`[^`\n]*`", "Code", text)


def sentences(text: str) -> list[str]:
    """Sentences of a page's prose; an item of a list and what follows a colon count as one of their own."""
    paragraphs = re.split(r"\n\s*\n|\n\s*(?:[*+-]|\d+\.) ", plain(text))
    return [one for part in paragraphs for one in re.split(r"(?<=[.!?:])\**\s+(?=[A-Z*\[(0-9])", part) if one.strip()]


#: words of all pages but those of bench/, and of single pages
MOST_WORDS = {"": 43_200, "README.md": 600, "docs/safety.md": 4000}
#: expression -> how often it may and must stand in 10 000 words of prose
RATES = {";": (0, 15), r"\byour?\b": (60, 1000), r"\b(anew|beside|nobody|somebody)\b": (0, 3)}
LONG_SENTENCES = 0.03  # share of sentences of more than 25 words


def test_the_pages_are_short() -> None:
    known = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True).stdout.split()
    if not known:
        pytest.skip("no git repository")
    words = {name: len((ROOT / name).read_text(encoding="utf-8").split()) for name in known}
    words[""] = sum(count for name, count in words.items() if not name.startswith("bench/"))
    assert {name: words[name] for name, most in MOST_WORDS.items() if words[name] > most} == {}


def test_the_prose_is_plain() -> None:
    text = "\n\n".join(
        plain(path.read_text(encoding="utf-8")) for name, path in PAGES.items() if name != "CONTRIBUTING.md"
    )
    rates = {rate: 1e4 * len(re.findall(rate, text, re.IGNORECASE)) / len(text.split()) for rate in RATES}
    assert {rate: value for rate, value in rates.items() if not RATES[rate][0] <= value <= RATES[rate][1]} == {}
    found = [(name, one) for name, path in PAGES.items() for one in sentences(path.read_text(encoding="utf-8"))]
    long = [f"{name}: {' '.join(one.split())}" for name, one in found if len(one.split()) > 25]
    print(f"{len(long)} of {len(found)} sentences have more than 25 words:", *long, sep="\n")
    assert len(long) <= LONG_SENTENCES * len(found)


@pytest.mark.parametrize("script", ["draw_touch_flow", "draw_guard_phases"])
def test_the_drawing_is_what_its_script_draws(script: str) -> None:
    code = f"from {script} import TARGET, drawing; assert drawing() == TARGET.read_text(encoding='utf-8')"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT / "scripts", timeout=60)
    assert done.returncode == 0, f"python scripts/{script}.py draws it anew"
