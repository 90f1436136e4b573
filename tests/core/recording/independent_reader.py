"""A reader of recordings made from docs/look-up/recording.md alone, which imports nothing of coneskin."""

import struct
import zlib
from pathlib import Path

Item = tuple[int, float, bytes]  # kind, time, payload


def read_file(data: bytes) -> tuple[int | None, list[tuple[int, int, int, list[Item]]], int]:
    """Return the number of the run, the chunks (run, sequence, span, blocks) and the bytes that are in none."""
    magic, _, run, crc = struct.unpack("<8sIQI", data[:24])
    whole = magic == b"CONESKIN" and crc == zlib.crc32(data[:20])
    chunks, stray, at = [], 0 if whole else 24, 24
    while at < len(data):
        head = data[at : at + 68]
        if len(head) == 68 and head[:4] == b"\xa7CSK" and zlib.crc32(head[:64]) == int.from_bytes(head[64:], "little"):
            length, of, sequence, span, count, _, first, last, encoding = struct.unpack("<IQQIIQddB", head[4:57])
            body = data[at + 68 : at + 68 + length]
            if len(body) == length and zlib.crc32(body) == int.from_bytes(head[60:64], "little"):
                blocks = split(zlib.decompress(body) if encoding == 1 else body)
                assert len(blocks) == count
                assert (min(b[1] for b in blocks), max(b[1] for b in blocks)) == (first, last)
                chunks.append((of, sequence, span, blocks))
                at += 68 + length
                continue
        stray += 1
        at += 1
    return run if whole else None, chunks, stray


def split(body: bytes) -> list[Item]:
    blocks = []
    while body:
        length, kind, time = struct.unpack("<IBd", body[:13])
        blocks.append((kind, time, body[13 : 13 + length]))
        body = body[13 + length :]
    return blocks


def read(path: Path) -> tuple[list[Item], list[str]]:
    """Return the blocks that are not the file's own, and which of the page's invariants do not hold."""
    paths = [path]
    while (further := path.with_name(f"{path.stem}.{len(paths):04d}{path.suffix}")).exists():
        paths.append(further)
    broken, every, runs = set(), [], []
    for part in paths:
        run, chunks, stray = read_file(part.read_bytes())
        if run is None:
            broken.add("1")
        runs.append(run)
        if stray and run is not None:
            broken.add("2")
        every += chunks
    own = next((run for run in runs if run is not None), every[0][0] if every else None)
    if any(chunk[0] != own for chunk in every):
        broken.add("2")
    every = [chunk for chunk in every if chunk[0] == own]
    due, blocks = 0, []
    if every != sorted(every, key=lambda chunk: chunk[1]):
        broken.add("3")
    for _, sequence, span, found in sorted(every, key=lambda chunk: chunk[1]):
        if sequence != due:
            broken.add("3")
        if sequence >= due:
            due = sequence + span
            blocks += found
    if not blocks or blocks[-1][0] != 0:
        broken.add("4")
    if any(kind == 254 or (kind == 10 and b'"recording_gap"' in payload) for kind, _, payload in blocks):
        broken.add("5")
    return [block for block in blocks if 0 < block[0] < 240], sorted(broken)
