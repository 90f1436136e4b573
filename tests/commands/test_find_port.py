"""A port is found by what is there before and after; the lists are made up, time is a list as well."""

import os
from pathlib import Path

import pytest

from coneskin.commands.find_port import _await_port, _port_trouble, _settled_port, _stable_name
from coneskin.core.errors import SkinTimeout
from coneskin.skin.sources.serial_port import PortFacts

A = PortFacts("/dev/ttyUSB0", "FT232R", "USB VID:PID=0403:6001 SER=A1")
B = PortFacts("/dev/ttyUSB1", "FT232R", "USB VID:PID=0403:6001 SER=B2")
A_ELSEWHERE = A._replace(device="/dev/ttyUSB2")


def found(*lists: list[PortFacts], timeout: float = 60.0) -> tuple[PortFacts, list[str]]:
    said: list[str] = []
    left, now = iter(lists), iter(range(100))
    port = _await_port(lambda: next(left, lists[-1]), said.append, timeout, lambda: float(next(now)), lambda _: None)
    return port, said


def test_unplugged_and_plugged_in_again() -> None:
    assert found([A, B], [A, B], [B], [B], [A, B]) == (
        A,
        [
            "unplug the device (within 60 s; Ctrl-C ends)",
            "/dev/ttyUSB0 has gone: plug it in again",
            f"{A} has come",
        ],
    )


def test_a_device_that_comes_back_under_another_name() -> None:
    port, said = found([A, B], [B], [A_ELSEWHERE, B])
    assert port == A_ELSEWHERE
    assert said[-1] == f"{A_ELSEWHERE} has come; it was /dev/ttyUSB0 before"


def test_a_device_that_was_not_there() -> None:
    assert found([], [A]) == (A, ["plug the device in (within 60 s; Ctrl-C ends)", f"{A} has come"])


def test_a_hub_is_no_device() -> None:
    port, said = found([A, B], [], [A, B], [B], [A, B])
    assert port == A
    assert "2 ports have come at once" in said[2]
    assert said[2].endswith("not a hub: unplug the device")


def test_it_gives_up_with_advice() -> None:
    with pytest.raises(SkinTimeout, match=r"no port has come within 5 s; try another cable"):
        found([A], timeout=5.0)


@pytest.mark.skipif(os.name != "posix", reason="ports have no groups there")
def test_a_port_that_is_not_permitted_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = tmp_path / "ttyUSB0"
    port.touch()
    assert _port_trouble(str(port)) == ""
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert _port_trouble(str(port)) == (
        f"{port}: not permitted; run `sudo usermod -aG {port.group()} $USER`, and log in again"
    )
    assert _port_trouble(str(tmp_path / "none")) == f"{tmp_path / 'none'}: no such port"


@pytest.mark.skipif(os.name != "posix", reason="ports have no groups there")
@pytest.mark.parametrize("late", [8, 14])
def test_a_port_that_a_busy_computer_permits_late(late: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to 2.8 s late: each wait is one of 0.2 s."""
    port, waited = tmp_path / "ttyUSB0", list[float]()
    port.touch()
    monkeypatch.setattr(os, "access", lambda *_: len(waited) >= late)
    assert _settled_port(str(port), waited.append) == ("", str(port))
    assert len(waited) == late
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "not permitted" in _settled_port(str(port), waited.append)[0]
    assert sum(waited) < late * 0.2 + 3.0


@pytest.mark.skipif(os.name != "posix", reason="links there need rights")
def test_the_name_that_stays_is_preferred(tmp_path: Path) -> None:
    port, folder = tmp_path / "ttyUSB0", tmp_path / "by-id"
    port.touch()
    folder.mkdir()
    assert _stable_name(str(port), folder) == str(port)
    (folder / "usb-FTDI_A1-if00").symlink_to(port)
    assert _stable_name(str(port), folder) == str(folder / "usb-FTDI_A1-if00")
    assert _stable_name(str(port), tmp_path / "none") == str(port)
