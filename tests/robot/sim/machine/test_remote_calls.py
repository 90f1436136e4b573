"""Programs of the simulated controller as clients of XML-RPC; the server is Python's own."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest

from tests.robot.sim.program_bench import Bench

PATIENCE = 60.0  # s that a test waits for a program


class Handler(SimpleXMLRPCRequestHandler):
    """Says nothing on stderr."""

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@pytest.fixture
def server() -> Iterator[SimpleXMLRPCServer]:
    with SimpleXMLRPCServer(("127.0.0.1", 0), Handler, allow_none=True) as made:
        thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join(PATIENCE)


def run(body: str, port: int) -> Bench:
    """Run a program that has a handle named ``server``, to its end."""
    bench = Bench(start_delay=0.0)
    bench.controller.outside_time = time.monotonic
    bench.send(f'def p():\nserver = rpc_factory("xmlrpc", "http://127.0.0.1:{port}/RPC2")\n{body}\nend\n')
    end = time.monotonic() + PATIENCE
    bench.step(1)
    while bench.controller.program is not None:
        bench.step(1)
        assert time.monotonic() < end
    return bench


def test_every_kind_of_value_goes_there_and_back(server: SimpleXMLRPCServer) -> None:
    seen: list[Any] = []
    server.register_function(lambda *values: (seen.append(values), values[0])[1], "echo")
    values = "True", "7", "2.5", '"text"', "[1, 2]", "p[1, 2, 3, 0.1, 0.2, 0.3]", "struct(a=1, b=[True])"
    bench = run("\n".join(f"textmsg(server.echo({value}, 3))" for value in values), server.server_address[1])
    assert [line["text"] for line in bench.events("text")] == [
        *("True", "7", "2.5", "text", "[1, 2]", "p[1, 2, 3, 0.1, 0.2, 0.3]", "struct(a=1, b=[True])")
    ]
    pose = {"x": 1.0, "y": 2.0, "z": 3.0, "rx": 0.1, "ry": 0.2, "rz": 0.3}
    assert seen == [(v, 3) for v in (True, 7, 2.5, "text", [1, 2], pose, {"a": 1, "b": [True]})]


def test_an_answer_is_waited_for_and_no_cycle_is_held_up(server: SimpleXMLRPCServer) -> None:
    asked, answer = threading.Event(), threading.Event()
    server.register_function(lambda: (asked.set(), answer.wait(PATIENCE))[1], "late")
    bench = Bench(start_delay=0.0)
    bench.controller.outside_time = time.monotonic
    port = server.server_address[1]
    bench.send(
        f'def p():\nserver = rpc_factory("xmlrpc", "http://127.0.0.1:{port}")\nset_digital_out(0, server.late())\nend'
    )
    while not asked.is_set():
        bench.step(1)
    bench.step(100)
    assert bench.controller.program is not None
    assert bench.controller.digital_outputs == 0
    answer.set()
    while bench.controller.program is not None:
        bench.step(1)
    assert bench.controller.digital_outputs == 1


def test_a_fault_ends_the_program_with_its_line(server: SimpleXMLRPCServer) -> None:
    bench = run("x = 1\nserver.nothing()", server.server_address[1])
    (abort,) = bench.events("abort")
    assert abort["reason"].startswith("line 4: ")
    assert 'method "nothing" is not supported' in abort["reason"]


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("http://127.0.0.1:1/RPC2", "hello: no server answers at 127.0.0.1 port 1"),
        ("http://192.0.2.1/RPC2", "start it with --host 0.0.0.0"),
        ("ftp://127.0.0.1:1", "takes a URL such as"),
        ("http://127.0.0.1:99999", "takes a URL such as"),
    ],
)
def test_a_server_that_is_not_there_ends_the_program(url: str, words: str) -> None:
    bench = Bench(start_delay=0.0)
    bench.send(f'def p():\nserver = rpc_factory("xmlrpc", "{url}")\nserver.hello()\nend')
    bench.step(50)
    assert words in bench.events("abort")[0]["reason"]
