"""Start of a session: time until the guard is active, processor time of each process, and what each one does.

    python -m bench start [--times 10] [--first]

From the call of ``guard(scene)`` with a virtual skin, without an arm and with a simulated one that runs already.
Processor times are those of whole processes, with their interpreters and imports. The picture is of one more start,
which the stamps make slower: a letter is what the process did at the end of that step.

On a computer that is busy with other things ``--first`` lets these processes run before the others, where that is
allowed.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from bench.report import head, show
from coneskin.robot.sim.process import SimulatedController, free_host
from tests.support.scenes import forearm_scene

from .processes import PATIENT_LIMITS
from .timeline import environment, legend, picture, spans

_STEP = 0.01  # s of a letter
_SKIN_SCENE = """
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
[source]
kind = "virtual"
rate_hz = 1000
"""
_START_PROGRAM = """
import json
import sys
import time

if sys.argv[2] == "first":
    from bench.loop.start import come_first

    come_first()
from bench.loop.processes import ran
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard

scene = parse_scene(sys.argv[1])
began = time.monotonic()
with guard(scene) as session:
    took = time.monotonic() - began
    program = time.process_time()
    children = {name: ran(child.pid) for name, child in session._processes.children.items()}
    print(json.dumps({"began": began, "active": took, "program": program, **children}))
"""


def come_first() -> None:
    """Let this process and its children run before others; Linux would rank children in sessions of their own anew."""
    if os.getsid(0) != os.getpid():
        os.setsid()
    os.setpriority(os.PRIO_PROCESS, 0, -20)
    Path("/proc/self/autogroup").write_text("-20")
    begin = subprocess.Popen.__init__

    def begin_here(self: subprocess.Popen[bytes], *arguments: Any, **named: Any) -> None:
        begin(self, *arguments, **{**named, "start_new_session": False})

    subprocess.Popen.__init__ = begin_here  # type: ignore[method-assign]


def start(arm: bool, first: bool, variables: Mapping[str, str] | None = None) -> dict[str, float]:
    """Return when the guard was called for and how long it took, and the processor time of each process [s]."""
    with ExitStack() as stack:
        text = _SKIN_SCENE
        if arm:
            simulated = stack.enter_context(SimulatedController(host=free_host()))
            text = forearm_scene(simulated.host, limits=PATIENT_LIMITS)
        command = [sys.executable, "-c", _START_PROGRAM, text, "first" if first else ""]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=variables or os.environ)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=10, help="starts (%(default)s)")
    parser.add_argument("--first", action="store_true", help="run before what else keeps this computer busy")
    args = parser.parse_args()
    print(head())
    rows, pictures = [], []
    if args.first:
        come_first()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for arm, name in ((False, "no arm"), (True, "an arm")):
            times = [start(arm, args.first) for _ in range(args.times)]
            for each in times:
                each["all"] = sum(value for key, value in each.items() if key not in ("began", "active"))
            cells = [[f"{of(t.get(k, 0.0) for t in times):.2f}" for of in (min, statistics.median)] for k in _COLUMNS]
            rows.append([name, *(" / ".join(cell) for cell in cells)])
            one = start(arm, args.first, environment(folder))
            found = [span for span in spans(folder) if span.end > one["began"]]
            (folder / "stamps").unlink()
            for process in dict.fromkeys(span.process for span in sorted(found, key=lambda span: span.begin)):
                line = picture(found, process, one["began"], one["began"] + one["active"], _STEP)
                pictures.append([f"{name}: {process}", f"|{line}"])
            words = legend(found)
    show("s, least / median", ["", "until active", *(f"{key}, processor" for key in _COLUMNS[1:])], rows)
    width = max(len(line) for _, line in pictures)
    said = ", ".join(f"{letter} {word}" for letter, word in words.items())
    show(f"a letter is {1e3 * _STEP:g} ms: {said}", ["", ""], [[name, f"{line:{width}}|"] for name, line in pictures])


_COLUMNS = ("active", "program", "guard", "skin", "driver", "all")
