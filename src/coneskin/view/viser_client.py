"""viser's client as a browser gets it: unpacked, and with plain edges where a processor draws.

viser 1.1 ships one file, in which both are compressed and written in 88 letters; a browser spends a tenth of the time
until the first picture on unpacking them, each time anew. A server does that once. What a page here never shows, the
photographed hall that is reflected until a server says otherwise, is left out. A client that is packed otherwise is
served as it is.

viser asks for smoothed edges in any case. Without a GPU they take a third of a picture's time (bench/RESULTS.md),
so a worker asks what draws, while the page is still read. With a GPU nothing changes. viser also has each picture
copied before it is shown, so that a server can ask for it. None does here.
"""

from __future__ import annotations

import base64
import gzip
import json
import re

__all__ = ["unpacked", "with_head", "with_plain_edges"]

#: printable letters but those that mean something in HTML or in a string
_BASE88_LETTERS = "".join(letter for letter in map(chr, range(0x21, 0x7F)) if letter not in "\"&<>'`")
_PACKED_CLIENT = re.compile(r'<script data-p="([^"]+)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
_DECODER_MODULE = re.compile(r'const gzWasm=("(?:[^"\\]|\\.)*")')
_HALL_PICTURE = re.compile(r"`data:image/jpeg;base64,[^`]*`")
_FORBIDDEN_TEXT = ("</script", "<!--")  # what an inline program must not contain


def unpacked(page: str) -> str:
    """Return a client with its parts unpacked; the same page where it is packed in another way."""
    found = _PACKED_CLIENT.search(page)
    decoder = None if found is None else _DECODER_MODULE.search(found[4])
    if found is None or decoder is None:
        return page
    try:
        style, program = _parts(found[1], int(found[2]), int(found[3]))
        module = gzip.decompress(_letters_to_bytes(json.loads(decoder[1])))
    except ValueError:  # other letters, another compression
        return page
    if any(end in program for end in _FORBIDDEN_TEXT) or "</style" in style or len(_HALL_PICTURE.findall(program)) != 1:
        return page
    ready = base64.b64encode(module).decode("ascii")  # the client's decoder of messages, which its loader publishes
    first = (
        f'globalThis.__viserZstdWasm=await WebAssembly.compile(Uint8Array.from(atob("{ready}"),c=>c.charCodeAt(0)));'
    )
    start, end = page[: found.start()], page[found.end() :]
    at = end.rindex("</body>")
    text = _HALL_PICTURE.sub("null", program)
    return f'{start}<style>{style}</style>{end[:at]}<script type="module">{first}\n{text}</script>{end[at:]}'


def _parts(letters: str, style: int, program: int) -> tuple[str, str]:
    import zstandard

    try:
        data = zstandard.ZstdDecompressor().decompress(_letters_to_bytes(letters), style + program)
    except zstandard.ZstdError as exc:
        raise ValueError(str(exc)) from exc
    if len(data) != style + program:
        raise ValueError(f"{len(data)} bytes in the place of {style + program}")
    return data[:style].decode("utf-8"), data[style:].decode("utf-8")


def _letters_to_bytes(text: str) -> bytes:
    """Return what is written in 88 letters: four bytes in five of them, and k - 1 bytes in a rest of k.

    Raises:
        ValueError: a letter is none of them.
    """
    import numpy as np

    values = np.full(256, -1, dtype=np.int64)
    values[[ord(letter) for letter in _BASE88_LETTERS]] = np.arange(len(_BASE88_LETTERS))
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


_PLAIN_EDGES_SCRIPT = """
(function () {
  const plain = HTMLCanvasElement.prototype.getContext;
  const inSoftware = (gl) => {
    if (gl === null) return false;
    const told = gl.getExtension('WEBGL_debug_renderer_info');
    const name = String(gl.getParameter(told === null ? gl.RENDERER : told.UNMASKED_RENDERER_WEBGL));
    const lose = gl.getExtension('WEBGL_lose_context');
    if (lose !== null) lose.loseContext();
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
  };
  let software = null;
  const ask = `postMessage((${inSoftware})(new OffscreenCanvas(1, 1).getContext('webgl2')))`;
  const asked = new Worker(URL.createObjectURL(new Blob([ask])));
  asked.onmessage = (event) => { software = event.data; asked.terminate(); };
  HTMLCanvasElement.prototype.getContext = function (kind, wanted, ...more) {
    if (kind !== 'webgl2' || !wanted || !wanted.antialias) return plain.call(this, kind, wanted, ...more);
    if (software === null) software = inSoftware(plain.call(document.createElement('canvas'), 'webgl2'));
    const cheap = { ...wanted, antialias: false, preserveDrawingBuffer: false };
    return plain.call(this, kind, software ? cheap : wanted, ...more);
  };
})();
"""


def with_plain_edges(page: str) -> str:
    """Return a page with the script in its head, before anything that draws."""
    return with_head(page, f"<script>{_PLAIN_EDGES_SCRIPT}</script>")


def with_head(page: str, head: str) -> str:
    """Return a page whose head begins with some HTML."""
    return page.replace("<head>", f"<head>{head}", 1)
