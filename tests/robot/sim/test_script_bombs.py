"""Programs and clients that mean harm end themselves, or their connection; the simulated controller goes on."""

from __future__ import annotations

import math
import random
import socket
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import _MAX_SECONDARY, Controller
from coneskin.robot.sim.machine.states import PORTS, Options
from coneskin.robot.sim.ports.rtde import RtdeOutputs, RtdeSession
from coneskin.robot.sim.process import free_host
from coneskin.robot.sim.server import _MAX_CLIENTS, Server
from coneskin.robot.sim.urscript.translator import MAX_LENGTH, complete_programs, translate
from coneskin.robot.sim.urscript.values import ScriptError
from coneskin.robot.ur.rtde_codec import (
    VARIABLES,
    PacketKind,
    pack,
    pack_inputs_request,
    pack_outputs_request,
)

_POSE = "p[0.4, 0.1, 0.5, 0, 3, 0]"
BOMBS = {
    "tower of powers": "a = 9^9^9^9",
    "huge power": "a = 9^9\n a = a^a",
    "brackets": "a = " + "(" * 3000 + "1" + ")" * 3000,
    "lists in lists": "a = " + "[" * 500 + "1" + "]" * 500,
    "calls in calls": "a = " + "d2r(" * 2000 + "1" + ")" * 2000,
    "signs": "a = " + "-" * 3000 + "1",
    "nots": "a = " + "not " * 3000 + "True",
    "powers of powers": "a = " + "1^" * 3000 + "1",
    "long sum": "a = 1" + "+1" * 20_000,
    "long digits": "a = " + "9" * 100_000,
    "foreign digits": "a = ٣\n b = a * ٣",
    "long text": 'a = "' + "x" * 200_000 + '"\n textmsg(a)',
    "text doubled": 'a = "x"\n while True:\n  a = a + a\n end',
    "text times number": 'a = "x" * 1000000000',
    "text formatted": 'a = "%1000000000d" % 5',
    "text in a list": 'a = ["x"] * 1000000000',
    "number doubled": "a = 3\n while True:\n  a = a + a\n end",
    "number squared": "a = 3\n while True:\n  a = a * a\n end",
    "long list": "a = [" + "1," * 50_000 + "1]",
    "list of itself": "a = [1, 2]\n while True:\n  a = [a, a]\n end",
    "list in itself": "a = [1, 2]\n a[0] = a\n textmsg(a)\n norm(a)",
    "wide lists": "a = [" + ",".join(["1"] * 200) + "]\n b = [" + ",".join(["a"] * 200) + "]\n movej(b)\n textmsg(b)",
    "endless loop": "while True:\n end",
    "endless costly loop": f"while True:\n  a = get_inverse_kin({_POSE})\n end",
    "recursion": "def f(x):\n  return f(x + 1)\n end\n f(1)",
    "waiting recursion": "def f(x):\n  sync()\n  return f(x + 1)\n end\n f(1)",
    "branching recursion": "def f(x):\n  if x > 0:\n   f(x - 1)\n   f(x - 1)\n  end\n end\n f(60)",
    "threads": "thread t():\n  sync()\n end\n while True:\n  a = run t()\n end",
    "threads of threads": "thread t():\n  a = run t()\n  sync()\n end\n a = run t()\n sleep(9)",
    "nested blocks": "\n".join(["if True:"] * 300 + ["a = 1"] + ["end"] * 300),
    "nested functions": "\n".join([f"def f{i}():" for i in range(300)] + ["a = 1"] + ["end"] * 300),
    "elifs": "if False:\n a = 1\n" + "elif False:\n a = 1\n" * 5000 + "end",
    "many functions": "\n".join(f"def f{i}():\n end" for i in range(5000)),
    "the same function twice": "def bomb():\n  a = 1\n end",
    "a keyword as a name": "popup(class=1)",
    "break outside": "break",
    "return of a global": "def f(x):\n global x = 1\n end\n f(1)",
    "a thread that kills itself": "thread t():\n  kill x\n  sync()\n end\n global x = run t()\n sleep(9)",
    "unknown variable": "a = b",
    "zero": "a = 1 / 0",
    "complex": "a = (-8) ^ 0.5",
    "output a million": "set_standard_digital_out(1000000000, True)",
    "output -1": "set_tool_digital_out(-1, True)",
    "output seventy": "set_tool_digital_out(70, True)",
    "register -1": "write_output_integer_register(-1, 5)",
    "register of a text": 'write_output_float_register(0, "x")',
    "tool at nowhere": "nan = 1e308 * 10 - 1e308 * 10\n set_tcp(p[nan, nan, nan, nan, nan, nan])",
    "tool far away": "set_tcp(p[1e300, 0, 0, 0, 0, 0])",
    "not a number as speed": "nan = 1e308 * 10 - 1e308 * 10\n speedj([0.1, 0, 0, 0, 0, 0], nan)",
    "no acceleration": "movej([1, -1, 1, -1, -1, 0], a=0, v=0)",
    "text as acceleration": 'speedj([0.1, 0, 0, 0, 0, 0], "fast")',
    "infinite time": "movej([1, -1, 1, -1, -1, 0], t=1e400)",
    "no time": "movej([1, -1, 1, -1, -1, 0], t=1e-300)",
    "huge speed": "speedj([1e6, 0, 0, 0, 0, 0], 1e6)",
    "huge tool speed": "speedl([1e6, 1e6, 0, 0, 0, 1e6], 1e6)",
    "huge gain": "servoj([9e5, 0, 0, 0, 0, 0], 0, 0, 1e-9, 1e6, 1e6)",
    "sleep for ever": "sleep(1e300)",
    "sleep of nothing": "nan = 1e308 * 10 - 1e308 * 10\n sleep(nan)",
    "watchdog of nothing": "rtde_set_watchdog(1, 1e-320)\n sleep(1)",
    "pose of texts": 'a = p["x", "y", 1, 2, 3, 4]\n movel(a)',
    "pose too short": "movel(p[1, 2, 3])",
    "a keyword as a named argument": "popup(lambda=1)",
    "break outside a loop in a function": "def f():\n  break\n end\n f()",
    "nested whiles": "\n".join(["while True:"] * 25 + ["end"] * 25),
    "whiles around a loop": "while True:\n  while True:\n   while True:\n   end\n  end\n end",
    "threads that start threads, each in its cycle": (
        "thread t():\n  while True:\n   a = run t()\n   b = run t()\n   sync()\n  end\n end\n a = run t()\n sleep(9)"
    ),
    "defaults in defaults": "def f(a=" + "(" * 200 + "1" + ")" * 200 + "):\n  return a\n end\n f()",
    "a line that goes on for ever": "a = [" + "\n1," * 3000,
    "a default that never ends": "def f(a=f()):\n  return a\n end\n f()",
    "many texts": (
        'a = make_list(200, "")\n i = 0\n while True:\n  a[i % 200] = str_cat(to_str(i), "x")\n  i = i + 1\n end'
    ),
    "lists of lists without end": "a = make_list(200, [1])\n while True:\n  b = make_list(200, a[0])\n end",
    "a history of for ever ago": "get_actual_joint_positions_history(1000000000000)",
    "a negative history": "get_actual_joint_positions_history(-1e9)",
    "a sleep of minus for ever": "sleep(-1e300)",
    "a socket of nowhere": 'socket_open("127.0.0.1", 99999999)',
    "sockets without end": 'i = 0\n while True:\n  socket_open("127.0.0.1", 9, to_str(i))\n  i = i + 1\n end',
    "a read of a million": "socket_read_byte_list(1000000)",
    "a blend of for ever": "movej([1, -1, 1, -1, -1, 0], r=1e6)\n movej([0, -1, 1, -1, -1, 0], r=1e6)",
    "an arc of no size": f"movec({_POSE}, {_POSE}, 0, 0)",
    "an arc to the stars": "movec(p[1e5, 0, 0, 0, 0, 0], p[0, 1e5, 0, 0, 0, 0])",
    "pauses": "while True:\n  pause\n end",
    "control characters": 'textmsg("\x00a(\x01\x02b=")\n \x00 = 1',
    "unfinished": "a = (",
}


class Watched:
    """A controller and a client that reads all its outputs in each cycle."""

    def __init__(self) -> None:
        self.controller = Controller(Options(start_delay=0.0, unlock_after=0.0))
        self._session = RtdeSession(self.controller, RtdeOutputs(self.controller))
        names = [name for name in VARIABLES if not name.startswith(("input_", "external_", "speed_slider_mask"))]
        self._session.receive(pack_outputs_request(names) + pack(PacketKind.START))

    def run(self, text: str, cycles: int = 30) -> str:
        """Run what arrives on a script port; return why it could not, or an empty string."""
        programs, _ = complete_programs(text)
        for text in programs:
            try:
                made = translate(text, Builtins.functions())
            except ScriptError as exc:
                return str(exc)
            if not made.secondary:
                self.controller.program_arrived()
            self.controller.load(made)
        for _ in range(cycles):
            self.controller.update()
            self._session.outputs()
            assert all(map(math.isfinite, self.controller.arm.q))
        return ""


@pytest.mark.long
@pytest.mark.parametrize("kind", ["def", "sec"])
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_ends_itself_and_the_next_program_runs(name: str, kind: str) -> None:
    watched = Watched()
    watched.run(f"{kind} bomb():\n {BOMBS[name]}\nend\n")
    watched.controller.stop_program("test")
    for _ in range(500):  # the arm may have to brake
        watched.controller.update()
    assert watched.controller.unlock()  # a speed beyond the joints' is a protective stop, as on a controller
    assert watched.run("def good():\n write_output_integer_register(7, 6 * 7)\nend\n") == ""
    assert watched.controller.output_ints[7] == 42


@pytest.mark.parametrize(
    "text", ["9^9^9\n", "9" * 300_000 + "\n", "(" * 5000 + "\n", "end\nend\n", "sec s():\nend\n" * 100]
)
def test_a_bomb_of_one_line(text: str) -> None:
    watched = Watched()
    watched.run(text)
    assert watched.run("write_output_integer_register(7, 42)\n") == ""
    assert watched.controller.output_ints[7] == 42


_WORDS = st.sampled_from(
    (
        *'ab109"x"[]()+-*/^%,=<:', "1e308", "p[", "==", "\n", "\n", "\n", "movej", "speedj", "sync()", "textmsg(",
        "set_tcp(", "not", "and", "or", "if", "while", "def", "sec", "thread", "end", "return", "break", "run", "kill",
        "join", "global", "local", "True",
    )
)  # fmt: skip


@pytest.mark.long
@settings(max_examples=150)
@given(st.lists(_WORDS, max_size=60))
def test_words_in_any_order_never_end_the_controller(words: list[str]) -> None:
    watched = Watched()
    watched.run("def bomb():\n" + " ".join(words) + "\nend\n", cycles=3)
    watched.controller.stop_program("test")
    assert watched.run("write_output_integer_register(7, 42)\n", cycles=3) == ""


@pytest.mark.long
def test_a_hundred_thousand_malformed_packets_change_nothing() -> None:
    dice = random.Random(16)
    watched = Watched()
    session = RtdeSession(watched.controller, RtdeOutputs(watched.controller))
    kinds = [kind.value for kind in PacketKind]
    for _ in range(100_000):
        body = dice.randbytes(dice.randrange(40))
        session.receive(struct.pack(">HB", len(body) + 3, dice.choice(kinds)) + body)
    assert len(session._rest) == 0
    assert watched.run("write_output_integer_register(7, 42)\n") == ""
    assert watched.controller.output_ints[7] == 42


def test_a_program_of_many_is_refused_beyond_a_number() -> None:
    watched = Watched()
    for _ in range(50):
        watched.run("sec s():\n while True:\n  sync()\n end\nend\n", cycles=1)
    assert len(watched.controller.secondary) == _MAX_SECONDARY


def _requests() -> dict[str, tuple[str, bytes]]:
    nan = struct.pack(">d", math.nan)
    return {
        "a frequency of almost nothing": ("RTDE", pack_outputs_request(["timestamp"], 5e-324)),
        "a frequency that is none": ("RTDE", pack(PacketKind.OUTPUTS, nan + b"timestamp")),
        "outputs without end": ("RTDE", pack_outputs_request(["actual_q"] * 7000) + pack(PacketKind.START)),
        "recipes without end": ("RTDE", pack_inputs_request(["input_int_register_0"]) * 400),
        "data of no recipe": ("RTDE", pack(PacketKind.DATA, b"\x07") + pack(PacketKind.DATA)),
        "short packets": ("RTDE", pack(PacketKind.OUTPUTS) + pack(PacketKind.INPUTS) + pack(PacketKind.TEXT, b"\xff")),
        "noise": ("RTDE", bytes(range(256)) * 40),
        "a line without end": ("dashboard", b"x" * 100_000),
        "lines of noise": ("dashboard", bytes(range(256)) * 4 + b"\n"),
        "a program without end": ("primary", b"def a():\n" + b" sync()\n" * (MAX_LENGTH // 7)),
        "a text without lines": ("secondary", b"x" * (MAX_LENGTH + 10)),
        "bytes that are no text": ("realtime", b"\xff\xfe\x00def \x00:\nend\n"),
    }


@pytest.mark.long
def test_no_client_ends_the_server() -> None:
    with Server(Controller(Options()), free_host()) as server:

        def turn(cycles: int) -> None:
            for _ in range(cycles):
                server._poll(0.0)
                server._cycle()
                server._publish()

        for name, (port, data) in _requests().items():
            with socket.create_connection((server.host, PORTS[port]), 60.0) as sock:
                sock.setblocking(False)
                while data:
                    try:
                        data = data[sock.send(data) :]
                    except BlockingIOError:
                        pass
                    except OSError:
                        break  # it has been dropped
                    turn(1)
                turn(10)
            turn(2)
            assert server.controller.cycle > 0, name
        crowd = [socket.create_connection((server.host, PORTS["dashboard"]), 60.0) for _ in range(5)]
        turn(20)
        assert 0 < len(server._clients["dashboard"]) <= _MAX_CLIENTS
        for sock in crowd:
            sock.close()


def test_more_clients_than_the_operating_system_can_watch_are_turned_away() -> None:
    with Server(Controller(Options()), free_host()) as server:
        crowd = []
        for _ in range(_MAX_CLIENTS + 10):
            crowd.append(socket.create_connection((server.host, PORTS["dashboard"]), 60.0))
            server._poll(0.0)
        assert len(server._clients["dashboard"]) == _MAX_CLIENTS
        for sock in crowd:
            sock.close()
