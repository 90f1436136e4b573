"""Files: reading within bounds, and writing whole or not at all.

Only regular files are read, and up to a limit, so that no file blocks a process or fills memory. What is written stands
beside the file until all of it is on the disk, and then takes its place.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from .errors import ConeSkinError

_FILE_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}
#: a pipe that somebody puts there between the two looks must not hold the opening up
_OPEN_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)


@contextmanager
def explain_os_error(refusal: Callable[[str], ConeSkinError], what: str, hint: str = "") -> Iterator[None]:
    """Let an OSError in the ``with`` become one of our errors, which says what cannot be done, why, and what to do.

    Args:
        refusal: makes the error of a text.
        what: cannot be done, such as "cannot write out.csv".
        hint: what to do, with the punctuation before it.
    """
    try:
        yield
    except OSError as exc:
        raise refusal(f"{what}: {exc.strerror or exc}{hint}") from exc


def read_file(path: Path, limit: int) -> bytes:
    """Return the content of a file of at most so many bytes; a link is followed.

    Raises:
        OSError: as of ``open_file``; or it has grown beyond the limit meanwhile.
    """
    with open_file(path, limit) as file:
        data = file.read(limit + 1)
    if len(data) > limit:
        raise _too_long(path, len(data), limit)
    return data


def read_text(path: Path, limit: int, what: str, refusal: Callable[[str], ConeSkinError], hint: str = "") -> str:
    """Return the text of a file of at most so many bytes, without the byte-order mark that some editors put in front.

    Args:
        path: of the file, in UTF-8.
        what: is wanted, such as "a TOML text".
        refusal: makes the error of a text.
        hint: where the file cannot be read.

    Raises:
        ConeSkinError: as ``refusal`` makes it: it cannot be read, is longer, or is no text.
    """
    with explain_os_error(refusal, "the file cannot be read", hint):
        try:
            return read_file(path, limit).decode("utf-8-sig")
        except UnicodeDecodeError as exc:
            raise refusal(f"this is not {what}: byte {exc.start} cannot stand in UTF-8; save it as UTF-8 text") from exc


def open_file(path: Path, limit: int) -> BinaryIO:
    """Open a regular file of at most so many bytes for reading, without waiting for anything; a link is followed.

    Raises:
        OSError: it is not there, or may not be read; it is a folder, a device, a pipe or a socket; it is too long.
            ``strerror`` says which.
    """
    try:
        _check(path, os.stat(path), limit)  # opening a device may already have an effect
        descriptor = os.open(path, _OPEN_FLAGS)
    except ValueError as exc:  # a NUL in the name
        raise OSError(errno.EINVAL, str(exc), str(path)) from exc
    try:
        _check(path, os.fstat(descriptor), limit)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def _format_size(count: int) -> str:
    """Return a number of bytes for people: "300 bytes", "1.5 MB"."""
    if count < 1000:
        return f"{count} bytes"
    for factor, unit in ((1e9, "GB"), (1e6, "MB")):
        if count >= factor:
            return f"{count / factor:.3g} {unit}"
    return f"{count / 1e3:.3g} kB"


def _check(path: Path, found: os.stat_result, limit: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = _FILE_KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise OSError(errno.EINVAL, f"it is {kind}, and only a regular file is read", str(path))
    if found.st_size > limit:
        raise _too_long(path, found.st_size, limit)


def _too_long(path: Path, size: int, limit: int) -> OSError:
    what = f"it has {_format_size(size)} or more, and at most {_format_size(limit)} are read; is it the right file?"
    return OSError(errno.EFBIG, what, str(path))


@contextmanager
def draft_of(path: Path, overwrite: bool = False) -> Iterator[Path]:
    """Yield where to write a file, so that whoever reads it, or pulls the plug, finds the whole file or none.

    Args:
        path: the file; at the end of the ``with`` the draft gets its name. After an error there is neither.
        overwrite: in place of an older file.

    Raises:
        FileExistsError: there is one, and it must stay.
        OSError: the draft cannot be written or renamed.
    """
    draft = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield draft
        _bring_to_disk(draft)
        if not overwrite and path.exists():
            raise FileExistsError(17, "File exists", str(path))
        draft.replace(path)
        with suppress(OSError):  # a folder cannot be opened everywhere
            _bring_to_disk(path.parent)
    finally:
        with suppress(OSError):
            draft.unlink()


def _bring_to_disk(path: Path) -> None:
    number = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def write_whole(path: Path, text: str) -> None:
    """Write a text in place of an older file, or of none, as ``draft_of`` does.

    Raises:
        OSError: it cannot be written; what was there is still there.
    """
    with draft_of(path, overwrite=True) as draft:
        draft.write_text(text, encoding="utf-8")
