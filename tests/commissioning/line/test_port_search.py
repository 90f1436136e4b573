"""A port is found by what is there before and after; the lists are made up, time is a list as well."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.commands.find_port import _find_port
from coneskin.commissioning.line.port_search import PortSearch, port_trouble, stable_name
from coneskin.core.errors import SkinTimeout
from coneskin.skin.sources.serial_port import PortFacts

A = PortFacts("/dev/ttyUSB0", "FT232R", "USB VID:PID=0403:6001 SER=A1")
B = PortFacts("/dev/ttyUSB1", "FT232R", "USB VID:PID=0403:6001 SER=B2")
A_ELSEWHERE = A._replace(device="/dev/ttyUSB2")


def found(*lists: list[PortFacts]) -> tuple[PortFacts | None, list[str]]:
    search = PortSearch(lists[0])
    said = [search.request]
    for present in lists[1:]:
        said += [words, search.request] if (words := search.update(present)) else []
    return search.found, said


def test_unplugged_and_plugged_in_again() -> None:
    port, said = found([A, B], [A, B], [B], [B], [A, B])
    assert port == A
    assert said[:3] == ["unplug the device", "/dev/ttyUSB0 has gone", "plug it in again"]


def test_a_device_that_comes_back_under_another_name() -> None:
    port, said = found([A, B], [B], [A_ELSEWHERE, B])
    assert port == A_ELSEWHERE
    assert said[3] == f"{A_ELSEWHERE} has come; it was /dev/ttyUSB0 before"


def test_a_device_that_was_not_there() -> None:
    assert found([], [A]) == (A, ["plug the device in", f"{A} has come", "unplug the device"])


def test_a_hub_is_no_device() -> None:
    port, said = found([A, B], [], [A, B], [B], [A, B])
    assert port == A
    assert "2 ports have come at once" in said[3]


def test_it_waits_and_says_what_to_do() -> None:
    lists: Iterator[list[PortFacts]] = iter([[A], [A], [], [A]])
    said: list[str] = []
    assert _find_port(lambda: next(lists), said.append, 60.0, lambda: 0.0, lambda _: None) == A
    assert said == [
        "unplug the device (within 60 s; Ctrl-C ends)",
        "/dev/ttyUSB0 has gone: plug it in again",
        f"{A} has come",
    ]


def test_it_gives_up_with_advice() -> None:
    now = iter(range(100))
    with pytest.raises(SkinTimeout, match=r"no port has come within 5 s; try another cable"):
        _find_port(lambda: [A], lambda _: None, 5.0, lambda: float(next(now)), lambda _: None)


@pytest.mark.skipif(os.name != "posix", reason="ports have no groups there")
def test_a_port_that_is_not_permitted_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = tmp_path / "ttyUSB0"
    port.touch()
    assert port_trouble(str(port)) == ""
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert port_trouble(str(port)) == (
        f"{port}: not permitted; run `sudo usermod -aG {port.group()} $USER`, and log in again"
    )
    assert port_trouble(str(tmp_path / "none")) == f"{tmp_path / 'none'}: no such port"


@pytest.mark.skipif(os.name != "posix", reason="links there need rights")
def test_the_name_that_stays_is_preferred(tmp_path: Path) -> None:
    port, folder = tmp_path / "ttyUSB0", tmp_path / "by-id"
    port.touch()
    folder.mkdir()
    assert stable_name(str(port), folder) == str(port)
    (folder / "usb-FTDI_A1-if00").symlink_to(port)
    assert stable_name(str(port), folder) == str(folder / "usb-FTDI_A1-if00")
    assert stable_name(str(port), tmp_path / "none") == str(port)
