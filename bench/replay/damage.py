"""Random damage of a recording: bits, cuts, chunks twice and swapped; recorders that are killed. See replay.py."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from coneskin.core.errors import ConeSkinError
from coneskin.core.recording.block import Block
from coneskin.core.recording.chunk import FILE_HEAD_SIZE
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.scan import Chunk, walk
from coneskin.runs.replay.run import Verdict, read_run

_REPLAY_EVERY = 10  # one trial in so many is replayed as well
_HANG_TIME = 30.0  # s of processor time for one trial
_CHILD_PROGRAM = """
import sys, time
from pathlib import Path
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.runs.replay.run import read_run
blocks = list(read_run(sys.argv[1]).blocks)
header = read_run(sys.argv[1]).header
import json
with Recorder(Path(sys.argv[2]), copied=frozenset({20, 22})) as recorder:
    recorder.write(Block(20, blocks[0].time, json.dumps(header).encode()))
    start, first = time.monotonic(), blocks[0].time
    print("go", flush=True)
    for block in blocks:
        wait = block.time - first - (time.monotonic() - start)
        if wait > 0.002:
            time.sleep(wait)
        recorder.write(block, flush=block.kind == 10)
        print(f"{block.time - first:.4f}", flush=True)
    time.sleep(60.0)
"""


def damage(path: Path, folder: Path, trials: int) -> Iterator[str]:
    """Yield lines of a table: what was done so many times, and what the reader made of it."""
    data = path.read_bytes()
    whole = _chunks(data, path)
    kinds: dict[str, Callable[[random.Random], bytes]] = {
        "a bit flipped": lambda r: _flipped(data, r, 1),
        "ten bits flipped": lambda r: _flipped(data, r, 10),
        "cut off": lambda r: data[: r.randrange(len(data))],
        "bytes cut out": lambda r: _cut(data, r),
        "bytes put in": lambda r: _put(data, r),
        "4 kB of zeros": lambda r: _zeros(data, r),
        "a chunk twice": lambda r: _pieces(data, whole, r, "twice"),
        "two chunks swapped": lambda r: _pieces(data, whole, r, "swap"),
        "a chunk cut out": lambda r: _pieces(data, whole, r, "cut"),
    }
    yield f"{'':22} trials  unreadable  plain same  intact chunk lost  false block  traceback  slowest ms  agrees"
    for kind, make in kinds.items():
        seen: Counter[str] = Counter()
        slowest = 0.0
        count = -(-trials // len(kinds))
        for trial in range(count):
            hurt = make(random.Random(f"{kind} {trial}"))
            if hurt == data:
                continue
            began = time.process_time()
            seen.update(_judge(hurt, data, whole, folder, trial % _REPLAY_EVERY == 0))
            slowest = max(slowest, time.process_time() - began)
        yield (
            f"{kind:22} {count:6} {seen['unreadable']:11} {seen['same']:11} {seen['lost']:18} {seen['false']:12} "
            f"{seen['traceback']:10} {1e3 * slowest:11.0f}  {seen['agrees']:4} of {seen['replayed']}"
        )


def _judge(hurt: bytes, data: bytes, whole: list[Chunk], folder: Path, again: bool) -> Iterator[str]:
    path = folder / "hurt.rec"
    path.write_bytes(hurt)
    try:
        recording = read_recording(path)
        got = list(recording)
        if not recording.defects:
            yield "same"
        intact = [chunk for chunk in whole if data[chunk.offset : chunk.end] in hurt]
        expected = [block for chunk in intact for block in _blocks(chunk)]
        if got != expected:
            every = {block for chunk in whole for block in _blocks(chunk)}
            yield "false" if set(got) - every else "lost"
        if again:
            run = read_run(path)
            result = run.replay()
            yield "replayed"
            if result.verdict is Verdict.SAME:
                yield "same"
            if not result.differences:
                yield "agrees"
    except ConeSkinError:
        yield "unreadable"
        if any(data[chunk.offset : chunk.end] in hurt for chunk in (whole[0], whole[-1])):
            yield "lost"  # the header is there twice, and one of them is intact
    except Exception:
        traceback.print_exc()
        yield "traceback"


def _blocks(chunk: Chunk) -> list[Block]:
    return [block for block in chunk.blocks() if 0 < block.kind < 240]


def _chunks(data: bytes, path: Path) -> list[Chunk]:
    with open(path, "rb") as file:
        return [piece for piece in walk(file, FILE_HEAD_SIZE, len(data)) if isinstance(piece, Chunk)]


def _flipped(data: bytes, r: random.Random, bits: int) -> bytes:
    hurt = bytearray(data)
    for _ in range(bits):
        hurt[r.randrange(len(hurt))] ^= 1 << r.randrange(8)
    return bytes(hurt)


def _cut(data: bytes, r: random.Random) -> bytes:
    at = r.randrange(len(data))
    return data[:at] + data[at + r.randrange(1, 20_000) :]


def _put(data: bytes, r: random.Random) -> bytes:
    at, source = r.randrange(len(data)), r.randrange(len(data))
    new = r.choice((r.randbytes(r.randrange(1, 5000)), data[source : source + r.randrange(1, 20_000)]))
    return data[:at] + new + data[at:]


def _zeros(data: bytes, r: random.Random) -> bytes:
    at = r.randrange(0, len(data), 4096)
    return data[:at] + bytes(len(data[at : at + 4096])) + data[at + 4096 :]


def _pieces(data: bytes, whole: list[Chunk], r: random.Random, how: str) -> bytes:
    parts = [data[chunk.offset : chunk.end] for chunk in whole]
    one, other = r.sample(range(len(parts)), 2)
    if how == "twice":
        parts.insert(other, parts[one])
    elif how == "swap":
        parts[one], parts[other] = parts[other], parts[one]
    else:
        del parts[one]
    return data[:FILE_HEAD_SIZE] + b"".join(parts)


def kill(path: Path, folder: Path, trials: int) -> Iterator[str]:
    """Yield lines: recorders that write a run at its own pace, killed at random times."""
    times = [block.time for block in read_run(path).blocks]
    length = 0.9 * (max(times) - times[0])
    lost: list[float] = []
    seen: Counter[str] = Counter()
    for trial in range(trials):
        target = folder / f"killed-{trial}.rec"
        command = [sys.executable, "-c", _CHILD_PROGRAM, str(path), str(target)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            child.stdout.readline()
            time.sleep(random.Random(trial).uniform(0.0, length))
            child.send_signal(signal.SIGKILL)
            lines = child.stdout.read().split("\n")[:-1]  # what follows the last line feed was torn
        written = float(lines[-1]) if lines else 0.0
        run = read_run(target)
        first = next(iter(read_run(path).blocks)).time
        kept = max((block.time for block in run.blocks), default=first) - first
        lost.append(max(0.0, written - kept))
        result = run.replay() if trial % _REPLAY_EVERY == 0 else None
        seen.update(["not closed" if not run.complete else "CLOSED"])
        if result is not None:
            seen.update([str(result.verdict)])
        target.unlink()
    ordered = sorted(1e3 * value for value in lost)
    yield f"{trials} recorders killed: lost {ordered[len(ordered) // 2]:.1f} ms (median), {ordered[-1]:.1f} ms (worst)"
    yield f"read: {dict(seen)}"
