"""Pure and compiled code side by side: the guard's core, a stop, a replay, and the decode of a frame.

    make build/compiled/done
    python -m bench compiled [--seconds 60] [--rounds 5] [--runs FOLDER] [--disturbed 20]

The two take turns, each in a process of its own: `src` is pure Python, `build/compiled` is compiled by mypyc. Inputs
are a simulated long run, and tests/data/collision.rec for what a touch costs. Times of the core, of reading and of the
replay are of the processor, the smallest of all rounds. The bare floor is a loop that only checks each frame's
checksum, and packs a stop for one of them.

Last come the digests of all outputs of both: of every run below tests/data and --runs, of the long run, and of the
collision with random counts, lost, repeated and damaged frames in it. Ends with 1 where the two differ in a bit.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from statistics import median

from bench.report import head, show
from coneskin.core.recording.block import Block
from coneskin.core.version import code_build
from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.signals.journal import INPUTS, BlockKind, GuardEvent, Output
from coneskin.runs.replay.run import read_run
from coneskin.runs.run_files import find_recordings
from coneskin.scene.build import build_core, build_stream
from coneskin.skin.wire import FRAME_LENGTH, encode, frame_at

ROOT = Path(__file__).parents[2]
COLLISION = ROOT / "tests" / "data" / "collision.rec"
TREES = {"pure": ROOT / "src", "compiled": ROOT / "build" / "compiled"}
STOPS = 10  # runs up to the touch, in a round
UNTOUCHED_FRAMES = 500  # of the collision's run that are timed before its touch
DISTURBED_SHARE = 0.02  # of the frames of a disturbed run


class Sink(list[Output]):
    """Outputs of a core, and when the first stop came out."""

    stopped = 0.0

    def append(self, output: Output, /) -> None:
        if not self.stopped and isinstance(output, StopProgram):
            self.stopped = time.perf_counter()
        super().append(output)


def inputs_of(path: Path) -> tuple[Callable[[], GuardCore], list[Block]]:
    """Return what makes a new core for a run, and the inputs of the run."""
    run = read_run(path)
    scene, places = run.scene(), run.place_sensors()
    return (lambda: build_core(scene, places)), [block for block in run.blocks if block.kind in INPUTS]


def processor(work: Callable[[], object]) -> float:
    """Return the processor's time for some work [s]."""
    began = time.process_time()
    work()
    return time.process_time() - began


def measure(long: Path) -> dict[str, object]:
    """Measure this build once; figures in us, but for the two of a whole run, which are in s."""
    new_core, inputs = inputs_of(long)
    core, outputs = new_core(), list[Output]()

    def one_by_one() -> None:
        for block in inputs:
            core.feed(block, outputs)

    def floor() -> None:
        for block in inputs:
            zlib.crc32(block.payload)

    figures = {
        "core, one input at a time": [1e6 * processor(one_by_one) / len(inputs)],
        "bare floor of an input: its checksum": [1e6 * processor(floor) / len(inputs)],
        "read the file, whole run": [processor(lambda: sum(1 for _ in read_run(long).blocks))],
        "replay, whole run": [processor(lambda: read_run(long).replay())],
        **touches(),
    }
    return {"build": code_build(), "figures": figures}


def digests(paths: list[str], disturbed: int) -> dict[str, object]:
    """Return the digest of all outputs of each run, and of the collision disturbed in so many ways."""
    found = {}
    for path in paths:
        new_core, inputs = inputs_of(Path(path))
        found[path] = digest(new_core(), inputs)
    new_core, inputs = inputs_of(COLLISION)
    for seed in range(disturbed):
        found[f"disturbed-{seed}"] = digest(new_core(), disturb(inputs, random.Random(seed)))
    return {"build": code_build(), "outputs": found}


def digest(core: GuardCore, inputs: list[Block]) -> tuple[int, int, str]:
    """Return the numbers of inputs and of outputs of a core, and the digest of the outputs."""
    outputs, said = list[Output](), hashlib.sha256()
    for block in inputs:
        core.feed(block, outputs)
    for output in outputs:
        said.update(repr(output).encode())
        if isinstance(output, GuardEvent):
            said.update(json.dumps(output.details).encode())
    return len(inputs), len(outputs), said.hexdigest()


def disturb(inputs: list[Block], chance: random.Random) -> list[Block]:
    """Return the inputs with frames that are damaged, lost, or repeated, or that hold other counts."""
    found = []
    for block in inputs:
        frame = frame_at(block.payload) if block.kind == BlockKind.SKIN else None
        if frame is None or chance.random() > DISTURBED_SHARE:
            found.append(block)
            continue
        kind, at = chance.choice(("damaged", "lost", "repeated", "counts")), chance.randrange(len(block.payload))
        if kind == "damaged":
            found.append(block._replace(payload=block.payload[:at] + b"\x55" + block.payload[at + 1 :]))
        elif kind == "repeated":
            found += [block, block]
        elif kind == "counts":
            name = chance.choice(("touch_c", "touch_d", "radial_c", "angular_b", "radial_current", "angular_current"))
            found.append(block._replace(payload=encode(frame._replace(**{name: chance.randrange(4096)}))))
    return found


def touches() -> dict[str, list[float]]:
    """Return what the collision's touch costs [us]: up to the stop, and frame by frame in its stream."""
    new_core, inputs = inputs_of(COLLISION)
    stops, floors = [], []
    first = 0  # input with the touch
    for _ in range(STOPS):
        core, sink = new_core(), Sink()
        for number, block in enumerate(inputs):
            began = time.perf_counter()
            core.feed(block, sink)
            if sink.stopped:
                first = number
                stops.append(1e6 * (sink.stopped - began))
                break
        began = time.perf_counter()
        zlib.crc32(inputs[first].payload)
        StopProgram(1.0).encode()
        floors.append(1e6 * (time.perf_counter() - began))
    frames = [block for block in inputs if block.kind == BlockKind.SKIN and len(block.payload) == FRAME_LENGTH]
    scene = read_run(COLLISION).scene()
    touch = next(number for number, block in enumerate(frames) if block.time >= inputs[first].time)
    untouched, touched, early = [], [], []
    for _ in range(STOPS):
        stream = build_stream(scene)
        for number, block in enumerate(frames):
            began = time.perf_counter()
            stream.feed(block.payload, block.time)
            took = 1e6 * (time.perf_counter() - began)
            if touch - UNTOUCHED_FRAMES <= number < touch:
                untouched.append(took)
            elif number in (touch, touch + 1):
                early.append(took)
            elif number > touch and stream.detectors[0].touched:
                touched.append(took)
    return {
        "touch fed -> StopProgram": stops,
        "bare floor of a stop: checksum, and pack": floors,
        "decode and detect, untouched frame": untouched,
        "decode and detect, first two frames of a touch": early,
        "decode and detect, touched frame": touched,
    }


def paths(build: str) -> dict[str, str]:
    """Return the environment of a process that runs this build."""
    before = os.environ.get("PYTHONPATH", "")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(TREES[build]), str(ROOT), before])}


def child(build: str, task: str) -> dict[str, object]:
    """Let a build do a task, of this module's name and in JSON, in a process of its own."""
    command = [sys.executable, "-m", "bench.loop.compiled", "--child", task]
    done = subprocess.run(command, env=paths(build), cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout)


def main() -> int:
    """Let the two builds take turns, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="of the long run (default: %(default)s)")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--runs", type=Path, action="append", default=[], help="folder with runs to compare as well")
    parser.add_argument("--disturbed", type=int, default=20, help="disturbed runs to compare (default: %(default)s)")
    args = parser.parse_args()
    from bench.replay.long_run import record_long_run

    print(head())
    rounds: dict[str, list[dict[str, object]]] = {build: [] for build in TREES}
    with tempfile.TemporaryDirectory() as folder:
        long = Path(folder) / "long.rec"
        record_long_run(long, COLLISION, args.seconds)
        for _ in range(args.rounds):
            for build, tree in TREES.items():
                rounds[build].append(child(build, json.dumps(["measure", str(long)])))
                if rounds[build][-1]["build"] != build:
                    parser.error(f"{tree} is not {build}: make build/compiled/done, and make pure for the checkout")
        runs = [*map(str, find_recordings([COLLISION.parent, *args.runs], beside=True)), str(long)]
        task = json.dumps(["digests", runs, args.disturbed])
        outputs = {build: child(build, task)["outputs"] for build in TREES}
    rows = []
    for name in rounds["pure"][0]["figures"]:
        values = {b: [v for result in rounds[b] for v in result["figures"][name]] for b in rounds}
        unit = "s" if name.endswith("whole run") else "us"
        cells = [f"{of(values[build]):.2f}" for build in rounds for of in (min, median)]
        rows.append([f"{name} [{unit}]", *cells, f"{min(values['pure']) / min(values['compiled']):.2f}"])
    columns = ["", "pure: least", "median", "compiled: least", "median", "times faster"]
    show(f"a run of {args.seconds:g} s, and a touch; {args.rounds} rounds", columns, rows)
    replays = [min(v for result in rounds[b] for v in result["figures"]["replay, whole run"]) for b in rounds]
    rates = ", ".join(f"{build} {args.seconds / took:.0f}" for build, took in zip(rounds, replays, strict=True))
    print(f"\nreplay, reading included: {rates} times real time")
    one, other = outputs.values()
    rows = [[Path(name).name, *map(str, one[name]), "yes" if one[name] == other[name] else "NO"] for name in one]
    show("outputs of both builds", ["run", "inputs", "outputs", "sha256", "same"], rows)
    return int(one != other)


if __name__ == "__main__" and sys.argv[1:2] == ["--child"]:
    task, *values = json.loads(sys.argv[2])
    print(json.dumps(measure(Path(values[0])) if task == "measure" else digests(*values)))
