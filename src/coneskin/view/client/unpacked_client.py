"""viser's client unpacked: style and program as they are, in the place of the packed ones.

viser 1.1 ships one file, in which both are compressed and written in 88 letters; a browser spends a tenth of the time
until the first picture on unpacking them, each time anew. A server does that once. What a page here never shows, the
photographed hall that is reflected until a server says otherwise, is left out. A client that is packed otherwise is
served as it is.
"""

from __future__ import annotations

import base64
import gzip
import json
import re

__all__ = ["letters_to_bytes", "unpacked"]

#: printable letters but those that mean something in HTML or in a string
_LETTERS = "".join(letter for letter in map(chr, range(0x21, 0x7F)) if letter not in "\"&<>'`")
_PACKED = re.compile(r'<script data-p="([^"]+)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
_DECODER = re.compile(r'const gzWasm=("(?:[^"\\]|\\.)*")')
_HALL = re.compile(r"`data:image/jpeg;base64,[^`]*`")
_ENDS = ("</script", "<!--")  # what an inline program must not contain


def unpacked(page: str) -> str:
    """Return a client with its parts unpacked; the same page where it is packed in another way."""
    found = _PACKED.search(page)
    decoder = None if found is None else _DECODER.search(found[4])
    if found is None or decoder is None:
        return page
    try:
        style, program = _parts(found[1], int(found[2]), int(found[3]))
        module = gzip.decompress(letters_to_bytes(json.loads(decoder[1])))
    except ValueError:  # other letters, another compression
        return page
    if any(end in program for end in _ENDS) or "</style" in style or len(_HALL.findall(program)) != 1:
        return page
    ready = base64.b64encode(module).decode("ascii")  # the client's decoder of messages, which its loader publishes
    first = (
        f'globalThis.__viserZstdWasm=await WebAssembly.compile(Uint8Array.from(atob("{ready}"),c=>c.charCodeAt(0)));'
    )
    start, end = page[: found.start()], page[found.end() :]
    at = end.rindex("</body>")
    text = _HALL.sub("null", program)
    return f'{start}<style>{style}</style>{end[:at]}<script type="module">{first}\n{text}</script>{end[at:]}'


def _parts(letters: str, style: int, program: int) -> tuple[str, str]:
    import zstandard

    try:
        data = zstandard.ZstdDecompressor().decompress(letters_to_bytes(letters), style + program)
    except zstandard.ZstdError as exc:
        raise ValueError(str(exc)) from exc
    if len(data) != style + program:
        raise ValueError(f"{len(data)} bytes in the place of {style + program}")
    return data[:style].decode("utf-8"), data[style:].decode("utf-8")


def letters_to_bytes(text: str) -> bytes:
    """Return what is written in 88 letters: four bytes in five of them, and k - 1 bytes in a rest of k.

    Raises:
        ValueError: a letter is none of them.
    """
    import numpy as np

    values = np.full(256, -1, dtype=np.int64)
    values[[ord(letter) for letter in _LETTERS]] = np.arange(len(_LETTERS))
    digits = values[np.frombuffer(text.encode("latin-1"), dtype=np.uint8)]
    if (digits < 0).any():
        raise ValueError("a letter is not of the 88")
    whole = len(digits) // 5 * 5
    groups = digits[:whole].reshape(-1, 5) @ (88 ** np.arange(4, -1, -1, dtype=np.int64))
    rest = 0
    for digit in digits[whole:].tolist():
        rest = 88 * rest + digit
    left = max(len(digits) - whole - 1, 0)
    return groups.astype(">u4").tobytes() + rest.to_bytes(left, "big")
