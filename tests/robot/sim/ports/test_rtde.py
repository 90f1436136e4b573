"""One RTDE connection of the simulated controller, byte for byte, without sockets."""

from __future__ import annotations

import io
import struct

import pytest

from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.inputs_outputs import INPUTS
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.ports.rtde import RtdeOutputs, RtdeSession, available
from coneskin.robot.ur.rtde_codec import (
    VARIABLES,
    PacketKind,
    Recipe,
    pack,
    pack_inputs_request,
    pack_outputs_request,
    split,
)
from tests.support.paths import ROOT


def session(controller: Controller) -> RtdeSession:
    return RtdeSession(controller, RtdeOutputs(controller))


def ask(connection: RtdeSession, request: bytes) -> bytes:
    """The payload of the one reply."""
    ((kind, payload),), rest = split(connection.receive(request))
    assert kind == request[2]
    assert rest == b""
    return payload


def write(connection: RtdeSession, ident: int, names: tuple[str, ...], values: tuple[float, ...]) -> None:
    assert connection.receive(pack(PacketKind.DATA, Recipe(names, ident).pack(values))) == b""


def test_versions_are_answered() -> None:
    connection = session(Controller(Options(version=(5, 25))))
    assert ask(connection, pack(PacketKind.PROTOCOL_VERSION, b"\x00\x02")) == b"\x01"
    assert ask(connection, pack(PacketKind.PROTOCOL_VERSION, b"\x00\x01")) == b"\x00"
    assert struct.unpack(">4I", ask(connection, pack(PacketKind.CONTROLLER_VERSION))) == (5, 25, 0, 1)


def test_requests_may_come_in_pieces() -> None:
    connection = session(Controller(Options()))
    request = pack_outputs_request(("timestamp",))
    assert connection.receive(request[:7]) == b""
    assert split(connection.receive(request[7:]))[0][0].payload == b"\x01DOUBLE"


def test_outputs_flow_after_start_at_their_frequency() -> None:
    controller = Controller(Options())
    connection = session(controller)
    assert ask(connection, pack(PacketKind.START)) == b"\x00"  # nothing to send yet
    names = ("timestamp", "actual_q", "robot_mode", "actual_digital_output_bits", "actual_tool_accelerometer")
    types = ask(connection, pack_outputs_request(names, 125.0))
    assert types == b"\x01DOUBLE,VECTOR6D,INT32,UINT64,VECTOR3D"
    controller.update()
    assert connection.outputs() == b""
    assert ask(connection, pack(PacketKind.START)) == b"\x01"
    sent = []
    for _ in range(8):
        controller.update()
        sent += split(connection.outputs())[0]
    assert len(sent) == 2
    stamp, q, mode, bits, acceleration = Recipe(names).unpack(sent[-1].payload)
    assert (stamp, q, mode, bits) == (0.016, tuple(controller.arm.q), 7, 0)
    assert acceleration == (0.0, 0.0, -9.81)
    assert ask(connection, pack(PacketKind.PAUSE)) == b"\x01"
    controller.update()
    assert connection.outputs() == b""


def test_every_output_of_the_table_can_be_asked_for() -> None:
    controller = Controller(Options())
    names = [name for name in VARIABLES if available(name, (5, 25))]
    assert len(names) > 200
    for start in range(0, len(names), 40):
        connection = session(controller)
        part = tuple(names[start : start + 40])
        assert ask(connection, pack_outputs_request(part))[0] == 1
        ask(connection, pack(PacketKind.START))
        controller.update()
        (packet,), _ = split(connection.outputs())
        values = dict(zip(part, Recipe(part).unpack(packet.payload), strict=True))
        assert len(values) == len(part)
        for name in values.keys() & {"tool_digital_output0_mode", "tool_digital_output1_mode"}:
            assert values[name] == 1, "sinking"


def test_unknown_outputs_are_named_in_their_place_without_an_empty_entry() -> None:
    connection = session(Controller(Options(version=(5, 4))))
    reply = ask(connection, pack_outputs_request(("timestamp", "nothing", "ft_raw_wrench")))
    assert reply == b"\x00DOUBLE,NOT_FOUND,NOT_FOUND"
    assert ask(connection, pack(PacketKind.START)) == b"\x00"


def test_input_recipes_are_numbered_and_kept_after_the_client() -> None:
    controller = Controller(Options())
    connection = session(controller)
    assert ask(connection, pack_inputs_request(("input_int_register_0",))) == b"\x01INT32"
    both = ("input_int_register_0", "input_double_register_3")
    assert ask(connection, pack_inputs_request(both)) == b"\x02INT32,DOUBLE"
    write(connection, 2, both, (7, 2.5))
    connection.close()
    assert [controller.inputs.values[name] for name in both] == [7, 2.5]
    assert ask(session(controller), pack_inputs_request(both)) == b"\x01INT32,DOUBLE"  # numbers are the connection's


def test_an_input_has_one_owner() -> None:
    controller = Controller(Options())
    first, second = session(controller), session(controller)
    ask(first, pack_inputs_request(("input_int_register_1",)))
    wanted = pack_inputs_request(("input_int_register_2", "input_int_register_1"))
    assert ask(second, wanted) == b"\x00INT32,IN_USE"
    assert ask(second, pack_inputs_request(("input_int_register_2",))) == b"\x01INT32"  # the refusal owned nothing
    first.close()
    assert ask(second, wanted) == b"\x02INT32,INT32"


def test_a_fieldbus_holds_the_lower_half_of_the_registers() -> None:
    connection = session(Controller(Options(fieldbus=True)))
    lower, upper = (pack_inputs_request((f"input_int_register_{number}",)) for number in (23, 24))
    assert ask(connection, lower) == b"\x00IN_USE"
    assert ask(connection, upper) == b"\x01INT32"


def test_a_cb3_sends_at_most_125_times_a_second() -> None:
    controller = Controller(Options(version=(3, 15)))
    connection = session(controller)
    for frequency, wanted in ((500.0, 25), (125.0, 25), (50.0, 12)):  # in 0.2 s; of 50 Hz there is 62.5
        ask(connection, pack_outputs_request(("timestamp",), frequency))
        ask(connection, pack(PacketKind.START))
        sent = 0
        for _ in range(100):
            controller.update()
            sent += bool(connection.outputs())
        assert sent == wanted


def test_inputs_work_without_start_and_masks_choose_the_bits() -> None:
    controller = Controller(Options())
    connection = session(controller)
    names = ("standard_digital_output_mask", "standard_digital_output")
    ask(connection, pack_inputs_request(names))
    write(connection, 1, names, (0b1010, 0b0110))
    assert controller.digital_outputs == 0b0010
    slider = ("speed_slider_mask", "speed_slider_fraction")
    ask(connection, pack_inputs_request(slider))
    write(connection, 2, slider, (1, 0.25))
    write(connection, 2, slider, (0, 0.75))
    assert controller.slider == 0.25


def test_a_packet_that_is_too_long_is_truncated_and_logged() -> None:
    log = io.StringIO()
    controller = Controller(Options(), log)
    connection = session(controller)
    ask(connection, pack_inputs_request(("input_int_register_0",)))
    connection.receive(pack(PacketKind.DATA, struct.pack(">Bid", 1, 5, 1.0)))
    assert controller.inputs.values["input_int_register_0"] == 5
    assert "recipe 1 has 5 bytes, got 13" in log.getvalue()


def test_noise_and_packets_of_no_recipe_change_nothing() -> None:
    controller = Controller(Options())
    connection = session(controller)
    assert connection.receive(b"\xff\x00\x01 GET / HTTP/1.1\r\n\r\n") == b""
    assert connection.receive(pack(PacketKind.DATA, b"\x09abc")) == b""
    assert connection.receive(pack(PacketKind.DATA)) == b""


def page_table() -> str:
    """The page's list of variables, as the controller has them; 0 to 47 stands for registers of these numbers."""
    simulated = RtdeOutputs(Controller(Options()))._getters
    names = [name for name in VARIABLES if "_register" not in name]
    outputs = [name for name in names if available(name, (5, 25))]
    groups = {
        "outputs that follow arm, programs and clients": [name for name in outputs if name in simulated],
        "outputs with a constant value": [name for name in outputs if name not in simulated],
        "inputs": [name for name in names if name in INPUTS],
        "registers, inputs and outputs": [
            f"{way}_{kind}"
            for way in ("input", "output")
            for kind in (
                "int_register_0 .. 47",
                "double_register_0 .. 47",
                "bit_registers0_to_31",
                "bit_registers32_to_63",
                "bit_register_64 .. 127",
            )
        ],
    }
    rows = [f"| {group} | {' '.join(f'`{name}`' for name in sorted(found))} |" for group, found in groups.items()]
    return "\n".join(["| variables | |", "|---|---|", *rows])


def test_the_page_lists_every_variable() -> None:
    text = (ROOT / "docs" / "look-up" / "sim-ur.md").read_text(encoding="utf-8")
    shown = text.split("<!-- variables -->")[1].split("<!-- end of variables -->")[0]
    assert shown.strip() == page_table(), "python -m tests.robot.sim.ports.test_rtde prints the table anew"


def test_every_published_input_is_taken_with_its_type() -> None:
    assert {name for name in VARIABLES if name.startswith("input_")} <= INPUTS <= VARIABLES.keys()
    for name in sorted(INPUTS):
        answer = ask(session(Controller(Options())), pack_inputs_request((name,)))
        assert answer[1:].decode() == VARIABLES[name], name


@pytest.mark.parametrize("name", ["actual_q", "timestamp", "output_int_register_0", "payload", "joint_mode"])
def test_an_output_is_no_input(name: str) -> None:
    assert ask(session(Controller(Options())), pack_inputs_request((name,))) == b"\x00NOT_FOUND"


@pytest.mark.parametrize("name", sorted(name for name in INPUTS if not name.startswith("input_")))
def test_an_input_that_is_no_register_is_no_output(name: str) -> None:
    assert ask(session(Controller(Options())), pack_outputs_request((name,))) == b"\x00NOT_FOUND"


if __name__ == "__main__":
    print(page_table())
