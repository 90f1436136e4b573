"""The command on files and on a pseudo-terminal that a C program plays into."""

import json
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest

from coneskin.cli import main
from coneskin.commands import monitor
from coneskin.commissioning.line.line_monitor import LineMonitor
from coneskin.core.errors import SkinTimeout
from coneskin.skin.diagnosis.cause import Cause
from coneskin.skin.sources.serial_port import SerialPort

from ..scene.scenes import SKIN_ONLY, record
from ..skin.diagnosis.corpus import BAUD, MISTAKES, NOT_TO_BE_NAMED, WITH_A_SCENE, build, bytes_of

posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
FIRST_LOOK = 2.0  # s until the monitor's first line
DEADLINE = 30.0  # s until a line has named the mistake


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("mistakes"))


def test_a_file_of_bytes_is_diagnosed(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bytes.bin"
    path.write_bytes(b"".join(data for _, data in bytes_of(program, "crc low byte first", 0.3)))
    assert main(["monitor", str(path)]) == 1
    assert capsys.readouterr().out.startswith("the checksum is another CRC: its low byte goes first: append")


def test_bytes_of_a_file_have_no_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, data, said in (
        ("same.bin", b"x" * 3000, "nothing but the byte 0x78 comes, 3000 times: "),
        ("other.bin", bytes(n * n % 251 for n in range(3000)), "3000 bytes come, but no frame: "),
    ):
        (tmp_path / name).write_bytes(data)
        assert main(["monitor", str(tmp_path / name)]) == 1
        assert capsys.readouterr().out.startswith(said)


@pytest.mark.pure
def test_a_computer_that_was_held_up_has_not_heard_that_the_device_stopped(
    program: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = [100.0]
    pieces = [data for _, data in bytes_of(program, "none", 1.6)]

    class Held:
        """A port whose reader stands still for 2 s just after it has waited in vain."""

        def __enter__(self) -> "Held":
            return self

        def __exit__(self, *_: object) -> None: ...

        def read(self, timeout: float) -> bytes:
            if pieces:
                clock[0] += 1e-3
                return pieces.pop(0)
            clock[0] += timeout + 2.0
            raise SkinTimeout("nothing came")

    monkeypatch.setattr(monitor.time, "monotonic", lambda: clock[0])
    line = SimpleNamespace(source=Held(), sensors=(), baud=None)
    args = SimpleNamespace(json=True, duration_s=1.7, hex=False)
    shown: list[str] = []
    monitor._listen(line, args, lambda report: shown.append(report.diagnosis.item))  # type: ignore[arg-type]
    assert len(shown) >= 2
    assert Cause.STOPPED.key not in shown


@pytest.mark.long
def test_a_recording_is_diagnosed_with_the_times_that_it_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.rec"
    record(path)
    assert main(["monitor", str(path), "--json"]) in (0, 1)
    heard = capsys.readouterr().out
    assert main(["monitor", str(tmp_path), "--json"]) in (0, 1)
    assert capsys.readouterr().out == heard  # the folder of a run is as good
    last = json.loads(heard.splitlines()[-1])
    assert last["sensors"][0]["clock_ratio"] == pytest.approx(1.0, rel=0.01)


def test_a_scene_is_heard_beside_what_it_expects(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SKIN_ONLY)
    main(["monitor", str(path), "--duration-s", "0.2", "--json"])
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert last["sensors"][0]["expected"]["touch_supply"] > 0


@posix
@pytest.mark.long
@pytest.mark.processes
def test_every_mistake_is_named_on_a_port(program: Path) -> None:
    """The corpus, each mistake on a pseudo-terminal of its own, in real time.

    That each is named within two seconds of its bytes is shown with given times, in test_diagnose. A computer that is
    busy with something else holds bytes back, and that is what is named until it lets them through: of a few at most.
    """
    names = [name for name in (*MISTAKES, *NOT_TO_BE_NAMED) if name not in WITH_A_SCENE]
    wrong: dict[str, str] = {}
    held_up: set[str] = set()

    def hear(name: str) -> None:
        sender = subprocess.Popen([program, name, f"{DEADLINE:g}", "--port"], stdout=subprocess.PIPE, text=True)
        assert sender.stdout is not None
        try:
            with SerialPort(sender.stdout.readline().strip(), BAUD) as port:
                listener = LineMonitor(start := time.monotonic(), (), BAUD)
                look_at = start + FIRST_LOOK
                while (now := time.monotonic()) < start + DEADLINE:
                    with suppress(SkinTimeout):
                        listener.feed(port.read(max(look_at - now, 0.0)), time.monotonic())
                    if now >= look_at:
                        look_at = now + 1.0
                        named = listener.report(now).diagnosis
                        if named.item == {**MISTAKES, **NOT_TO_BE_NAMED}[name].key:
                            wrong.pop(name, None)
                            held_up.discard(name)
                            return
                        wrong[name] = named.line
                        if named.item == Cause.HELD_UP.key:
                            del wrong[name]
                            held_up.add(name)
        finally:
            sender.kill()
            sender.communicate()

    for at in range(0, len(names), 16):
        threads = [threading.Thread(target=hear, args=(name,)) for name in names[at : at + 16]]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert wrong == {}
    assert len(held_up) <= 0.2 * len(names)
