"""A program with the node External Control takes its script from another program, and no cycle waits for it."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

import pytest

from coneskin.robot.sim.ports.user_interface import _request_script
from tests.robot.sim.ports.console import EXTERNAL, Console, save_program


def serve_once(listener: socket.socket, *parts: bytes) -> None:
    sock, _ = listener.accept()
    with sock:
        assert sock.makefile("rb").readline() == b"request_program\n"
        for part in parts:
            sock.sendall(part)
        sock.recv(1)  # until the other side has enough


def test_a_script_comes_in_parts_and_ends_with_a_pause() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        text = b"x = 1\n" * 20_000
        thread = threading.Thread(target=serve_once, args=(listener, text[:70_000], text[70_000:]))
        thread.start()
        assert _request_script(listener.getsockname()).result() == text.decode()
        thread.join()


def test_nobody_there_is_said() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()
    with pytest.raises(ConnectionRefusedError):
        _request_script(address).result()


def test_play_starts_what_the_other_program_answers(tmp_path: Path) -> None:
    save_program(tmp_path, "external_control", EXTERNAL)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        console = Console(tmp_path, external_control=listener.getsockname())
        script = b"write_output_integer_register(3, 7)\nsleep(9)\n"
        thread = threading.Thread(target=serve_once, args=(listener, script))
        thread.start()
        console.say("load external_control.urp")
        assert console.say("play") == "Starting program"
        thread.join()
        while console.say("running") != "Program running: true":
            console.step(1)
    console.step(1)
    assert console.controller.output_ints[3] == 7
    assert console.say("programState") == "PLAYING external_control.urp"


def test_play_without_an_answer_is_told_as_a_failed_program(tmp_path: Path) -> None:
    save_program(tmp_path, "external_control", EXTERNAL)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()
    console = Console(tmp_path, external_control=address)
    console.say("load external_control.urp")
    console.say("play")
    while not console.controller.notices:
        console.step(1)
    assert f"got no script from 127.0.0.1 port {address[1]}" in str(console.controller.notices[0])
    assert console.say("programState") == "STOPPED external_control.urp"


def test_stop_forgets_a_script_that_is_still_to_come(tmp_path: Path) -> None:
    save_program(tmp_path, "external_control", EXTERNAL)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        console = Console(tmp_path, external_control=listener.getsockname())
        console.say("load external_control.urp")
        console.say("play")
        console.say("stop")
        serve_once(listener, b"sleep(9)\n")
        console.step(100)
    assert console.say("running") == "Program running: false"
