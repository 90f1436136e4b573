"""Browser for bench `view`: chromium drawing in software, its processor time, and what is drawn."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

CHROMIUM_PROGRAM = "/usr/bin/chromium"
CHROMIUM_FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
PROCESS_KINDS = ("renderer", "gpu-process")  # of the browser: the first runs the page, the second draws
#: counts what is drawn by what begins a picture: the clearing of the canvas; and the corners of the fullest picture
COUNT_SCRIPT = """() => {
  window.pictures = window.corners = 0;
  let corners = 0;
  const { clear, drawElements } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.clear = function (...given) {
    window.pictures += 1;
    corners = 0;
    return clear.apply(this, given);
  };
  WebGL2RenderingContext.prototype.drawElements = function (mode, count, ...more) {
    corners += count;
    window.corners = Math.max(window.corners, corners);
    return drawElements.call(this, mode, count, ...more);
  };
}"""
_MIN_ARM_CORNERS = 3000  # corners that the first picture of a page with an arm has at least; an empty one has a few
#: what the browser offers to a page: turns of requestAnimationFrame in some seconds
TURN_SCRIPT = """(seconds) => new Promise((done) => {
  let turns = 0;
  const since = performance.now();
  const look = () => {
    turns += 1;
    if (performance.now() - since > 1e3 * seconds) done(turns / seconds); else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})"""
_TWICE_DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def resident(pid: int) -> int:
    """Memory of a process [kB]."""
    return int(next(li for li in Path(f"/proc/{pid}/status").read_text().splitlines() if "VmRSS" in li).split()[1])


def _below() -> list[list[str]]:
    """Processes below this one: id, id of the parent, command."""
    listing = subprocess.run(["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True, check=True).stdout
    rows = [line.split(None, 2) for line in listing.splitlines()[1:]]
    below, more = {os.getpid()}, {os.getpid()}
    while more:
        more = {int(row[0]) for row in rows if int(row[1]) in more} - below
        below |= more
    return [row for row in rows if int(row[0]) in below]


def browser_processes() -> list[int]:
    """All processes of the browsers that were started by this one."""
    return [int(row[0]) for row in _below() if "chrom" in row[2].split()[0]]


def _browsers() -> dict[str, list[int]]:
    """The browser's processes below this one, by their types."""
    rows = _below()
    return {kind: [int(row[0]) for row in rows if f"--type={kind}" in row[2]] for kind in PROCESS_KINDS}


def memory_of() -> dict[str, int]:
    """Memory of the browser's processes, by their types [kB]."""
    return {kind: sum(map(resident, pids)) for kind, pids in _browsers().items()}


def _processor_times() -> dict[str, float]:
    """Time that the browser's processes have run, by their types [s]."""
    tick = os.sysconf("SC_CLK_TCK")
    return {
        kind: sum(
            sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13])) / tick
            for pid in pids
        )
        for kind, pids in _browsers().items()
    }


def first_picture(driver: Any, url: str, phase: bool) -> tuple[Any, Any, float, dict[str, float]]:
    """Open an address in a new browser until its first picture.

    Args:
        driver: playwright's.
        url: of the page.
        phase: wait for the phase of a guard and for its arm as well.

    Returns:
        browser, page, how long it took from the address to the picture [s], and its processor time until then [s].
    """
    browser = driver.chromium.launch(executable_path=CHROMIUM_PROGRAM, args=list(CHROMIUM_FLAGS))
    page = browser.new_page(viewport={"width": 960, "height": 540})
    page.set_default_timeout(120_000)
    page.add_init_script(f"({COUNT_SCRIPT})()")
    began, before = time.monotonic(), _processor_times()
    page.goto(url)
    page.wait_for_function(
        "([phase, arm]) => window.pictures > 0 && "
        "(!phase || (document.querySelector('.coneskin-phase') && window.corners > arm))",
        arg=[phase, _MIN_ARM_CORNERS],
    )
    page.evaluate(_TWICE_DRAWN)
    after = _processor_times()
    return browser, page, time.monotonic() - began, {kind: after[kind] - before[kind] for kind in PROCESS_KINDS}


def drawn_pictures(page: Any, seconds: float) -> tuple[float, float, dict[str, float]]:
    """Turns and pictures a second for a while, and the processor time of the browser's processes meanwhile [s]."""
    page.evaluate("() => { window.pictures = 0; }")
    before = _processor_times()
    turns = page.evaluate(TURN_SCRIPT, seconds)
    after, pictures = _processor_times(), page.evaluate("() => window.pictures")
    return turns, pictures / seconds, {kind: after[kind] - before[kind] for kind in PROCESS_KINDS}
