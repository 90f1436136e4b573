"""Recordings: what damage and kills cost, how large they are and how fast they are read and replayed.

    python -m bench replay --damage 1000     random damage: no plain "same", no intact chunk lost, no traceback, no hang
    python -m bench replay --kill 100        recorders killed with SIGKILL at random times: what is lost
    python -m bench replay                   sizes, reading, exact replay, beside other formats
    python -m bench replay --memory 1000     the most memory that each command has, on a run of so many MB

The run is tests/data/collision.rec, 2 s of a simulated arm with a skin, or --run FILE. Times are of the processor, so
that other programs on the machine do not count. Does not show: a slow disk; a crash of the operating system.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from bench.report import head
from coneskin.runs.replay.run import read_run

from .damage import damage, kill
from .formats import formats
from .long_run import record_long_run
from .memory import memory

RUN_FILE = Path(__file__).parents[2] / "tests" / "data" / "collision.rec"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, default=RUN_FILE, help="a recording (default: %(default)s)")
    parser.add_argument("--damage", type=int, default=0, metavar="N", help="trials of random damage")
    parser.add_argument("--kill", type=int, default=0, metavar="N", help="recorders to kill")
    parser.add_argument("--memory", type=int, default=0, metavar="MB", help="size of the run for the table of memory")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the long run (default: %(default)s)")
    args = parser.parse_args()
    print(head("numpy", "pyarrow", "mcap", "python-can") + "\n")
    with tempfile.TemporaryDirectory() as folder:
        for line in damage(args.run, Path(folder), args.damage) if args.damage else ():
            print(line, flush=True)
        for line in kill(args.run, Path(folder), args.kill) if args.kill else ():
            print(line, flush=True)
        if args.damage or args.kill:
            return
        long = Path(folder) / "long.rec"
        record_long_run(long, args.run, args.seconds)
        if args.memory:
            (apart := Path(folder) / "apart").mkdir()
            for line in memory(long, apart, args.memory):
                print(line, flush=True)
            return
        for line in formats(long, Path(folder)):
            print(line, flush=True)
        for path, name in ((args.run, "the demo's collision, a third of it a retreat"), (long, "long run")):
            for line in speeds(path, name):
                print(line, flush=True)


def speeds(path: Path, name: str) -> Iterator[str]:
    """Yield lines: how often faster than it happened a run is read and replayed, on one core and on two."""
    _once(str(path))  # it imports
    length, began = _once(str(path))
    again, rate = read_run(path).replay(), length / began
    yield f"\n{name}: {length:.1f} s, {again.verdict}"
    began = time.process_time()
    count = sum(1 for _ in read_run(path).blocks)
    took = time.process_time() - began
    yield f"read: {count} blocks, {length / took:.0f} times real time, {path.stat().st_size / took / 1e6:.1f} MB/s"
    began = time.process_time()
    touches = read_run(path).touches()
    took = time.process_time() - began
    contacts = [event.time for event in read_run(path).events if event.name == "contact"]
    equal = "the same" if [touch.began for touch in touches] == contacts else "OTHERS than"
    yield f"touches, one core: {length / took:.0f} times real time, {len(touches)} of them, {equal} as the guard's"
    yield f"exact replay, one core: {rate:.1f} times real time (time of the processor)"
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(_once, [str(path)] * 2))  # they import
        wall = time.perf_counter()
        times = list(pool.map(_once, [str(path)] * 4))
        wall = time.perf_counter() - wall
    yield from _dask(path)
    each = sum(length / took for length, took in times) / len(times)
    clock = 4 * length / wall
    yield f"exact replay, two processes: {2 * each:.1f} times real time of the processors, {clock:.1f} by the clock"


def _dask(path: Path) -> Iterator[str]:
    """Yield how fast one and two workers of a local Dask cluster replay the run, each four times, by the clock."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as exc:
        yield f"exact replay, Dask: {exc.name} is not installed"
        return
    rates = []
    for workers in (1, 2):
        with (
            LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
            Client(cluster) as client,
        ):
            client.gather(client.map(_once, [str(path)] * 2 * workers, pure=False))  # they import
            wall = time.perf_counter()
            times = client.gather(client.map(_once, [str(path)] * 4 * workers, pure=False))
            rates.append(sum(length for length, _ in times) / (time.perf_counter() - wall))
    with ProcessPoolExecutor(2) as pool:  # what this machine's second core is worth: two that only count
        alone = pool.submit(_count).result()
        both = max(pool.map(_count, [0, 0]))
    yield (
        f"exact replay, Dask: one worker {rates[0]:.1f} times real time by the clock, two {rates[1]:.1f}: "
        f"{rates[1] / rates[0]:.2f} times one (two loops that only count: {2 * alone / both:.2f} times one)"
    )


def _count(_: int = 0) -> float:
    """Return the time by the clock in which a loop counts to ten million [s]."""
    began = time.perf_counter()
    for _ in range(10_000_000):
        pass
    return time.perf_counter() - began


def _once(path: str) -> tuple[float, float]:
    """Return the duration of a run, and the processor's time for its replay [s]."""
    began = time.process_time()
    result = read_run(path).replay()
    return result.duration, time.process_time() - began
