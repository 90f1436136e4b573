"""The tutorial as a notebook: made from its page, it runs, and whatever ends its kernel ends what was guarded."""

import importlib.util
import json
import os
import re
import signal
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from coneskin.robot.sim.process import free_host

from .support.paths import ROOT
from .test_docs import PageRun

specification = importlib.util.spec_from_file_location("notebook", ROOT / "scripts" / "notebook.py")
assert specification is not None
assert specification.loader is not None
notebook = importlib.util.module_from_spec(specification)
specification.loader.exec_module(notebook)

MARK = "CONESKIN_TEST_KERNEL"
GUARDED = """\
import coneskin as cs

scene = cs.parse_scene('''
[arm]
model = "UR5e"
host = "{host}"
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.3
height_mm = 240
[source]
kind = "virtual"
rate_hz = 250
[reaction]
kind = "stop"
[monitoring]
skin_silence_ms = 1000
arm_silence_ms = 1000
''')
home, goal = [-0.7, -1.57, 1.57, -1.57, -1.57, 0.0], [1.0, -1.4, 1.4, -1.57, -1.57, 0.0]
controller = cs.SimulatedController("UR5e", "{host}", home)
controller.__enter__()
session = cs.guard(scene).open()
session.arm.move_j(goal, speed=0.1, acceleration=1.0, wait=False)
print("moving")
"""


def test_the_notebook_is_what_its_script_makes_of_the_page() -> None:
    assert notebook.TARGET.read_text(encoding="utf-8") == notebook.notebook(notebook.PAGE.read_text(encoding="utf-8"))
    cells = json.loads(notebook.TARGET.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert any(source.startswith("%%writefile scene.toml\n[arm]") for source in sources)
    assert sum(source.startswith("!coneskin") for source in sources) >= 5
    assert len({cell["id"] for cell in cells}) == len(cells)


def with_exit_codes(source: str) -> str:
    """The same cell, which fails where a command does not end as the page says."""
    lines = []
    for line in source.splitlines():
        lines.append(line)
        if line.startswith("!"):
            code = match[1] if (match := re.search(r"# exit code (\d+)", line)) else "0"
            lines.append(f"assert _exit_code == {code}, _exit_code")
    return "\n".join(lines)


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs pseudo-terminals and loopback addresses")
def test_the_notebook_runs(tmp_path: Path) -> None:
    client = pytest.importorskip("nbclient", reason="needs pip install nbclient ipykernel")
    formats = pytest.importorskip("nbformat", reason="needs pip install nbclient ipykernel")
    page = PageRun(tmp_path)
    book = formats.reads(page.adapt(notebook.TARGET.read_text(encoding="utf-8")), as_version=4)
    for cell in book.cells:
        if cell.cell_type == "code":
            cell.source = with_exit_codes(cell.source)
    client.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = "".join(output.get("text", "") for cell in book.cells for output in cell.get("outputs", ()))
    assert "the events are the same, bit by bit" in said
    assert "1 passed" in said


def processes(mark: str) -> set[str]:
    """Names of the processes that a kernel has started, itself included, by a word in their environment."""
    found = set()
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and f"{MARK}={mark}".encode() in (folder / "environ").read_bytes():
                state = (folder / "stat").read_text().rpartition(")")[2].split()[0]
                if state != "Z":
                    found.add((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:  # it has ended meanwhile
            continue
    return found


class Kernel:
    """A kernel in a process of its own, as a notebook has one."""

    def __init__(self, folder: Path) -> None:
        manager = pytest.importorskip("jupyter_client.manager", reason="needs pip install nbclient ipykernel")
        self.mark = uuid.uuid4().hex
        self._options = {"env": {**os.environ, MARK: self.mark}, "cwd": str(folder)}
        self.manager = manager.KernelManager(kernel_name="python3")
        self.manager.start_kernel(**self._options)
        self.client = self.manager.blocking_client()
        self.client.start_channels()
        self.client.wait_for_ready(timeout=60)

    def run(self, code: str) -> dict[str, Any]:
        """Run a cell and return the kernel's reply."""
        return dict(self.client.execute_interactive(code, timeout=120, output_hook=lambda _: None)["content"])

    def wait_until_gone(self, *, but: int = 0) -> None:
        """Wait until at most ``but`` processes of the kernel are left."""
        end = time.monotonic() + 60.0
        while len(processes(self.mark)) > but and time.monotonic() < end:
            time.sleep(0.1)
        assert len(left := processes(self.mark)) <= but, left

    def close(self) -> None:
        self.client.stop_channels()
        self.manager.shutdown_kernel(now=True)
        self.manager.cleanup_resources()


@pytest.fixture
def kernel(tmp_path: Path) -> Iterator[Kernel]:
    if not sys.platform.startswith("linux"):
        pytest.skip("needs /proc")
    made = Kernel(tmp_path)
    yield made
    made.close()


@pytest.mark.long
def test_an_interrupt_ends_a_move_and_closing_ends_every_process(kernel: Kernel) -> None:
    assert kernel.run(GUARDED.format(host=free_host()))["status"] == "ok"
    assert len(processes(kernel.mark)) > 3
    sent = kernel.client.execute(
        "print('under way', flush=True); session.arm.move_j(home, speed=0.05, acceleration=1.0)",
        stop_on_error=False,  # what comes next is no part of it, and is run
    )
    # only then: a kernel that is interrupted between its own steps drops the cell and never answers
    while kernel.client.get_iopub_msg(timeout=60)["content"].get("text") != "under way\n":
        pass
    kernel.manager.interrupt_kernel()
    reply = kernel.client.get_shell_msg(timeout=60)
    assert reply["parent_header"]["msg_id"] == sent
    assert reply["content"]["ename"] == "KeyboardInterrupt"
    assert kernel.run("session.close(); controller.__exit__(None, None, None)")["status"] == "ok"
    kernel.wait_until_gone(but=1)  # the kernel lives


@pytest.mark.long
@pytest.mark.parametrize("how", ["restart", "kill"])
def test_a_kernel_that_ends_leaves_no_process(kernel: Kernel, how: str) -> None:
    assert kernel.run(GUARDED.format(host=free_host()))["status"] == "ok"
    assert len(processes(kernel.mark)) > 3
    if how == "restart":
        kernel.manager.restart_kernel(now=False)
        kernel.client.wait_for_ready(timeout=60)
        kernel.wait_until_gone(but=1)
        assert kernel.run("session")["ename"] == "NameError"
    else:
        kernel.manager.signal_kernel(signal.SIGKILL)
        kernel.wait_until_gone()
