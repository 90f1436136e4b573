"""Files are read within bounds: nothing blocks, nothing fills memory."""

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from coneskin.core.errors import ConeSkinError, RecordingError
from coneskin.core.files import _format_size, draft_of, open_file, read_file
from coneskin.core.recording.chunk import MAGIC
from coneskin.core.recording.reader import read_recording
from coneskin.geometry.mesh import load_mesh
from coneskin.geometry.urdf import urdf_links
from coneskin.scene.reader import load_scene, parse_scene


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _socket(path: Path) -> None:
    home = Path.cwd()
    os.chdir(path.parent)  # the name of a socket is at most 107 bytes long
    try:
        with socket.socket(socket.AF_UNIX) as sock:
            sock.bind(path.name)
    finally:
        os.chdir(home)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.write(MAGIC)
        file.truncate(100_000_000_000)


WRONG: dict[str, tuple[Callable[[Path], None], str]] = {
    "pipe": (_pipe, "it is a pipe, and only a regular file is read"),
    "device": (_device, "it is a device, and only a regular file is read"),
    "socket": (_socket, "it is a socket, and only a regular file is read"),
    "folder": (Path.mkdir, "it is a folder, and only a regular file is read"),
    "sparse": (_sparse, "it has 100 GB or more, and at most .* are read"),
}
pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes and devices have names on POSIX only")


@pytest.fixture(params=WRONG)
def wrong(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    make, words = WRONG[request.param]
    path = tmp_path / "wrong.stl"
    make(path)
    return path, words


def test_what_is_no_file_is_refused_at_once(wrong: tuple[Path, str]) -> None:
    with pytest.raises(OSError, match=wrong[1]):
        read_file(wrong[0], 1_000_000)


def test_a_file_that_is_longer_than_it_said_is_refused() -> None:
    """Files in /proc say that they are empty; one that grows behind the look at its size is the same."""
    path = Path("/proc/self/status")
    if not path.exists():
        pytest.skip("no /proc on this system")
    with open_file(path, 100):
        assert path.stat().st_size == 0
    with pytest.raises(OSError, match="it has 101 bytes or more, and at most 100 bytes are read"):
        read_file(path, 100)


def test_a_file_within_its_limit_is_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    assert read_file(path, 5) == b"12345"
    with pytest.raises(OSError, match="5 bytes or more, and at most 4 bytes"):
        read_file(path, 4)
    with pytest.raises(OSError, match="No such file"):
        read_file(tmp_path / "none", 4)
    with pytest.raises(OSError, match="null"):
        read_file(Path("a\0b"), 4)


def test_sizes_for_people() -> None:
    assert [_format_size(n) for n in (999, 1000, 1_500_000, 10**10)] == ["999 bytes", "1 kB", "1.5 MB", "10 GB"]


@pytest.mark.promise("P66")
def test_every_door_refuses_it(wrong: tuple[Path, str], tmp_path: Path) -> None:
    """A scene, a sensor file, a recording, a mesh and a URDF."""
    path, words = wrong
    sensor = f'[[link]]\nname = "a"\n[[link.sensor]]\nfile = "{path.name}"\n'
    doors: list[Callable[[], object]] = [
        lambda: load_scene(path),
        lambda: parse_scene(sensor, "s", tmp_path),
        lambda: read_recording(path),
        lambda: load_mesh(path),
        lambda: urdf_links(path),
    ]
    for door in doors:
        with pytest.raises(ConeSkinError, match=words):
            door()


def test_a_long_file_that_is_no_recording_is_refused_at_its_start(tmp_path: Path) -> None:
    """No name and no chunk where even the largest body would have ended: 60 GB are not searched for one."""
    path = tmp_path / "run.rec"
    with path.open("wb") as file:
        file.truncate(60_000_000_000)
    with pytest.raises(RecordingError, match="is no recording of coneskin"):
        read_recording(path)


@contextmanager
def _half_a_draft(path: Path) -> Iterator[None]:
    with draft_of(path) as draft:
        draft.write_bytes(b"half")
        assert draft.exists()
        yield
        raise ZeroDivisionError


def test_a_draft_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "file"
    with pytest.raises(ZeroDivisionError), _half_a_draft(path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_draft_takes_the_place_of_a_file_only_where_it_may(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"mine")
    with pytest.raises(FileExistsError), draft_of(path) as draft:
        draft.write_bytes(b"other")
    assert path.read_bytes() == b"mine"
    with draft_of(path, overwrite=True) as draft:
        draft.write_bytes(b"other")
    assert path.read_bytes() == b"other"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_written_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, order = tmp_path / "file", []
    monkeypatch.setattr("coneskin.core.files.os.fsync", lambda _: order.append(path.exists()))
    with draft_of(path) as draft:
        draft.write_bytes(b"all")
    assert order[:1] == [False]
