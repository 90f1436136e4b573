"""Unpacked client: byte for byte what a browser would have unpacked; that it works, a browser tests with each page."""

import base64
import gzip
import json
import random
import re

import pytest

from coneskin.view.page_server import page_client
from coneskin.view.viser_client import _letters_to_bytes, unpacked

LETTERS = [letter for letter in map(chr, range(33, 127)) if letter not in "\"&<>'`"]


def in_letters(data: bytes) -> str:
    """Four bytes as five digits to the base 88, the largest first; k bytes at the end as k + 1 digits."""
    found = ""
    for at in range(0, len(data), 4):
        part = data[at : at + 4]
        value, digits = int.from_bytes(part, "big"), ""
        for _ in range(len(part) + 1):
            value, digit = divmod(value, 88)
            digits = LETTERS[digit] + digits
        found += digits
    return found


@pytest.mark.parametrize("length", [0, 1, 2, 3, 4, 5, 7, 8, 1001])
def test_letters_say_the_bytes_that_were_written(length: int) -> None:
    data = random.Random(length).randbytes(length)
    assert _letters_to_bytes(in_letters(data)) == data
    assert _letters_to_bytes(in_letters(bytes([255] * length))) == bytes([255] * length)


def test_a_letter_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="88"):
        _letters_to_bytes("!!!&!")


def test_the_client_that_is_installed_is_unpacked_whole() -> None:
    """Its sizes are those that the packed one names; of the program only the hall that nobody sees is left out."""
    pytest.importorskip("viser", reason="viser is not installed: there is no client")
    packed = page_client()
    page = unpacked(packed)
    size = re.search(r'data-ss="(\d+)" data-cs="(\d+)"', packed)
    assert size is not None
    assert "data-p=" not in page
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)
    program = re.search(r'<script type="module">(.*?)</script>', page, re.DOTALL)
    assert style is not None
    assert program is not None
    assert len(style[1].encode()) == int(size[1])
    assert 0.9 * int(size[2]) < len(program[1].encode()) < int(size[2]) + 100_000
    assert "data:image/jpeg" not in page
    module = re.search(r'atob\("([^"]+)"\)', program[1])
    assert module is not None
    assert base64.b64decode(module[1])[:4] == b"\0asm"


def packed_page(program: bytes, letters: str | None = None) -> str:
    zstandard = pytest.importorskip("zstandard", reason="zstandard is not installed, which viser needs")
    style = b"b{}"
    said = in_letters(zstandard.ZstdCompressor().compress(style + program)) if letters is None else letters
    decoder = json.dumps(in_letters(gzip.compress(b"\0asm")))
    return (
        f'<html><head><script data-p="{said}" data-ss="{len(style)}" data-cs="{len(program)}">'
        f"const gzWasm={decoder};</script></head><body></body></html>"
    )


def test_a_page_without_the_hall_or_packed_otherwise_is_served_as_it_is() -> None:
    hall = b"a=`data:image/jpeg;base64,/9j/`;"
    assert "a=null;b()</script></body>" in unpacked(packed_page(hall + b"b()"))
    for page in (
        "<html><head></head><body></body></html>",
        packed_page(b"b()"),
        packed_page(hall + hall),
        packed_page(hall + b"'</script>'"),
        packed_page(hall, letters="!!!!!!!!!!"),
        packed_page(hall, letters="<" * 10),
        packed_page(hall).replace("gzWasm", "wasm"),
    ):
        assert unpacked(page) == page
