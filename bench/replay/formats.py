"""Size and speed of a recording beside other formats that hold the same blocks. See replay.py."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.recorder import Recorder

_CAN_LENGTH = 64  # bytes of a frame of CAN FD


def formats(path: Path, folder: Path) -> Iterator[str]:
    """Yield lines of a table; each format holds every block, and what is read back is compared."""
    blocks = list(read_recording(path))
    length = blocks[-1].time - blocks[0].time
    rows: dict[str, tuple[str, Callable[[Path], None], Callable[[Path], list[Block]]]] = {
        "coneskin recording": ("run.rec", lambda p: _write_ours(p, blocks), lambda p: list(read_recording(p))),
        "CSV, payload in hex": ("run.csv", lambda p: _write_csv(p, blocks), _read_csv),
        "npz, compressed": ("run.npz", lambda p: _write_npz(p, blocks), _read_npz),
        "MCAP, zstd chunks": ("run.mcap", lambda p: _write_mcap(p, blocks), _read_mcap),
        "Parquet, zstd": ("run.parquet", lambda p: _write_parquet(p, blocks), _read_parquet),
        "python-can BLF": ("run.blf", lambda p: _write_can(p, blocks), _read_can),
    }
    yield f"{len(blocks)} blocks of {length:.1f} s, {sum(len(b.payload) for b in blocks)} bytes of payload"
    yield f"{'':22} {'kB/s of run':>11} {'write ms/s':>11} {'read ms/s':>10}  equal   after a kill"
    kill = {"coneskin": "<= 50 ms lost", "CSV": "the buffer lost", "npz": "all lost", "Parquet": "all lost"}
    kill |= {"MCAP": "the open chunk lost", "python-can": "the buffer lost"}
    for name, (file, write, read) in rows.items():
        target = folder / file
        try:
            wrote = _measure(lambda write=write, target=target: write(target))  # type: ignore[misc]
            found: list[list[Block]] = []
            took = _measure(lambda read=read, target=target, found=found: found.append(read(target)))  # type: ignore[misc]
        except ImportError as exc:
            yield f"{name:22} {exc.name} is not installed"
            continue
        equal = [(b.kind, b.payload) for b in found[0]] == [(b.kind, b.payload) for b in blocks]
        equal = equal and max(abs(a.time - b.time) for a, b in zip(found[0], blocks, strict=True)) < 1e-6
        size = target.stat().st_size / 1e3 / length
        costs = f"{1e3 * wrote / length:11.2f} {1e3 * took / length:10.2f}"
        yield f"{name:22} {size:11.1f} {costs}  {'yes' if equal else 'NO':5}   {kill[name.split(',')[0].split()[0]]}"


def _measure(work: Callable[[], None]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def _write_ours(path: Path, blocks: list[Block]) -> None:
    with Recorder(path) as recorder:
        for block in blocks:
            recorder.write(block, flush=block.kind == 10)


def _write_csv(path: Path, blocks: list[Block]) -> None:
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows((kind, repr(moment), payload.hex()) for kind, moment, payload in blocks)


def _read_csv(path: Path) -> list[Block]:
    with open(path, newline="") as file:
        return [Block(int(kind), float(moment), bytes.fromhex(text)) for kind, moment, text in csv.reader(file)]


def _write_npz(path: Path, blocks: list[Block]) -> None:
    lengths = np.array([len(block.payload) for block in blocks], np.uint32)
    data = np.frombuffer(b"".join(block.payload for block in blocks), np.uint8)
    kinds, times = np.array([b.kind for b in blocks], np.uint8), np.array([b.time for b in blocks])
    np.savez_compressed(path, lengths=lengths, data=data, kinds=kinds, times=times)


def _read_npz(path: Path) -> list[Block]:
    with np.load(path) as found:
        data, ends = found["data"].tobytes(), np.cumsum(found["lengths"]).tolist()
        kinds, times = found["kinds"].tolist(), found["times"].tolist()
    starts = [0, *ends[:-1]]
    return [Block(k, t, data[a:b]) for k, t, a, b in zip(kinds, times, starts, ends, strict=True)]


def _write_mcap(path: Path, blocks: list[Block]) -> None:
    from mcap.writer import Writer

    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        channels: dict[int, int] = {}
        for block in blocks:
            if block.kind not in channels:
                channels[block.kind] = writer.register_channel(str(block.kind), "raw", 0)
            moment = round(1e9 * block.time)
            writer.add_message(channels[block.kind], moment, block.payload, moment)
        writer.finish()


def _read_mcap(path: Path) -> list[Block]:
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        found = make_reader(file).iter_messages(log_time_order=False)
        return [Block(int(channel.topic), message.log_time / 1e9, message.data) for _, channel, message in found]


def _write_parquet(path: Path, blocks: list[Block]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    kinds, times, payloads = zip(*blocks, strict=True)
    columns = {"kind": pa.array(kinds, pa.uint8()), "time_s": times, "payload": pa.array(payloads, pa.binary())}
    parquet.write_table(pa.table(columns), path, compression="zstd")


def _read_parquet(path: Path) -> list[Block]:
    from pyarrow import parquet

    table = parquet.read_table(path)
    return [Block(*row) for row in zip(*(table[name].to_pylist() for name in table.column_names), strict=True)]


def _write_can(path: Path, blocks: list[Block]) -> None:
    """Write each block as frames of CAN FD: the kind is the identifier, the first byte says whether more follow."""
    import can

    start = blocks[0].time
    with can.BLFWriter(path) as writer:
        for block in blocks:
            parts = [
                block.payload[at : at + _CAN_LENGTH - 2] for at in range(0, len(block.payload), _CAN_LENGTH - 2)
            ] or [b""]
            for number, part in enumerate(parts):
                data = bytes([number < len(parts) - 1, len(part)]) + part
                data += bytes(next(n for n in (8, 12, 16, 20, 24, 32, 48, 64) if n >= len(data)) - len(data))
                message = can.Message(
                    timestamp=block.time - start, arbitration_id=block.kind, data=data, is_fd=True, is_extended_id=False
                )
                writer.on_message_received(message)
    path.with_suffix(".start").write_text(repr(start))


def _read_can(path: Path) -> list[Block]:
    import can

    start, blocks, payload = float(path.with_suffix(".start").read_text()), [], b""
    with can.BLFReader(path) as reader:
        first: float | None = None
        for message in reader:
            first = message.timestamp if first is None else first
            more, length = message.data[0], message.data[1]
            payload += bytes(message.data[2 : 2 + length])
            if not more:
                blocks.append(Block(message.arbitration_id, start + message.timestamp - first, payload))
                payload = b""
    return blocks
