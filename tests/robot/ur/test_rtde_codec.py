"""The wire format of RTDE: what is packed is what is read, however the stream is chopped, whatever noise it holds."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.ur.rtde_codec import (
    VARIABLES,
    PacketKind,
    Recipe,
    Value,
    pack,
    pack_inputs_request,
    pack_outputs_request,
    split,
    split_names,
    unpack_types,
)

LAW = settings(max_examples=200)
PACKETS = st.lists(st.tuples(st.sampled_from(list(PacketKind)), st.binary(max_size=60)), max_size=8)
FINITE = st.floats(allow_nan=False, allow_infinity=False)


def test_the_bytes_of_a_version_request_are_those_of_the_guide() -> None:
    # RTDE guide, "RTDE_REQUEST_PROTOCOL_VERSION": size 5, type 86, version 2 as uint16
    assert pack(PacketKind.PROTOCOL_VERSION, b"\0\2") == bytes([0, 5, 86, 0, 2])


def test_the_bytes_of_an_outputs_request_are_those_of_the_guide() -> None:
    # 500.0 as an IEEE double, big endian, then the names joined by commas
    packet = pack_outputs_request(("timestamp", "actual_q"), 500.0)
    assert packet == bytes([0, 3 + 8 + 18, 79]) + bytes.fromhex("407f400000000000") + b"timestamp,actual_q"
    assert pack_inputs_request(("input_int_register_0",)) == bytes([0, 23, 73]) + b"input_int_register_0"


@LAW
@given(PACKETS, st.lists(st.integers(1, 20), min_size=1, max_size=10))
def test_any_chopping_gives_the_same_packets(packets: list[tuple[PacketKind, bytes]], chops: list[int]) -> None:
    stream = b"".join(pack(kind, payload) for kind, payload in packets)
    got, rest, at, turn = [], b"", 0, 0
    while at < len(stream):
        step = chops[turn % len(chops)]
        more, rest = split(rest + stream[at : at + step])
        got += more
        at += step
        turn += 1
    assert [(p.kind, p.payload) for p in got] == packets
    assert rest == b""


@LAW
@given(st.binary(max_size=300), st.integers(0, 300))
def test_noise_never_raises_and_is_cut_the_same_way_in_two_pieces(noise: bytes, cut: int) -> None:
    whole, rest = split(noise)
    first, between = split(noise[:cut])
    second, end = split(between + noise[cut:])
    assert first + second == whole
    assert end == rest


def test_bytes_that_cannot_be_a_header_are_skipped() -> None:
    packets, rest = split(b"\x00\x02U" + b"\xff\xff\xff" + pack(PacketKind.START))
    assert [p.kind for p in packets] == [PacketKind.START]
    assert rest == b""


def test_a_packet_that_is_too_long_is_refused() -> None:
    with pytest.raises(ValueError, match="65535"):
        pack(PacketKind.DATA, bytes(65533))


def _value(kind: str) -> st.SearchStrategy[Value]:
    one: dict[str, st.SearchStrategy[Value]] = {
        "DOUBLE": FINITE,
        "INT32": st.integers(-(2**31), 2**31 - 1),
        "UINT32": st.integers(0, 2**32 - 1),
        "UINT64": st.integers(0, 2**64 - 1),
        "UINT8": st.integers(0, 255),
        "BOOL": st.booleans(),
        "VECTOR3D": st.tuples(*[FINITE] * 3),
        "VECTOR6D": st.tuples(*[FINITE] * 6),
        "VECTOR6INT32": st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 6),
    }
    return one[kind]


@LAW
@given(st.data())
def test_a_recipe_reads_back_what_it_packed(data: st.DataObject) -> None:
    names = data.draw(st.lists(st.sampled_from(sorted(VARIABLES)), min_size=1, max_size=12))
    recipe = Recipe(names, ident=data.draw(st.integers(0, 255)))
    values = tuple(data.draw(_value(kind)) for kind in map(VARIABLES.__getitem__, recipe.names))
    payload = recipe.pack(values)
    assert payload[0] == recipe.ident
    assert len(payload) == recipe.size
    assert recipe.unpack(payload) == values


@pytest.mark.parametrize(
    ("name", "size"),
    [("actual_q", 48), ("actual_tool_accelerometer", 24), ("joint_mode", 24), ("actual_digital_input_bits", 8)]
    + [("runtime_state", 4), ("safety_mode", 4), ("standard_digital_output_mask", 1), ("timestamp", 8)]
    + [("input_bit_register_64", 1), ("output_int_register_47", 4), ("output_double_register_0", 8)],
)
def test_widths_are_those_of_the_guide(name: str, size: int) -> None:
    assert Recipe((name,)).size == 1 + size


def test_not_a_number_survives() -> None:
    (value,) = Recipe(("timestamp",)).unpack(Recipe(("timestamp",)).pack((math.nan,)))
    assert math.isnan(value)  # type: ignore[arg-type]


def test_an_unknown_variable_is_named() -> None:
    with pytest.raises(ValueError, match="no variable named actual_qq"):
        Recipe(("timestamp", "actual_qq"))


def test_a_data_packet_of_another_length_is_a_lost_connection() -> None:
    recipe = Recipe(("timestamp",), ident=7)
    with pytest.raises(RobotConnectionError, match="recipe 7 must hold 9 bytes, got 10"):
        recipe.unpack(bytes(10))


def test_values_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="robot_mode"):
        Recipe(("robot_mode",)).pack((2**40,))
    with pytest.raises(ValueError, match="actual_q"):
        Recipe(("actual_q",)).pack(((0.0,) * 5,))


def test_the_answer_to_a_set_up_request_becomes_a_recipe() -> None:
    recipe = unpack_types(b"\x03DOUBLE,VECTOR6D", ("timestamp", "actual_q"))
    assert (recipe.ident, recipe.names, recipe.size) == (3, ("timestamp", "actual_q"), 57)


@pytest.mark.parametrize(
    ("types", "words"),
    [
        (b"DOUBLE,NOT_FOUND", "actual_q is not known"),
        (b"IN_USE,VECTOR6D", "timestamp is in use by another client"),
        (b"DOUBLE,VECTOR3D", "actual_q should be VECTOR6D, the controller says VECTOR3D"),
        (b"DOUBLE", "1 types to 2 RTDE variables"),
    ],
)
def test_a_refusal_says_which_variable(types: bytes, words: str) -> None:
    with pytest.raises(RobotRefused, match=words):
        unpack_types(b"\x01" + types, ("timestamp", "actual_q"))


def test_a_trailing_comma_in_a_list_of_names_means_nothing() -> None:
    assert split_names(b"timestamp,actual_q,") == ("timestamp", "actual_q")


def test_the_header_counts_itself() -> None:
    assert struct.unpack(">HB", pack(PacketKind.PAUSE)) == (3, ord("P"))


def test_the_bytes_of_a_data_packet_are_big_endian_in_the_order_of_the_recipe() -> None:
    recipe = Recipe(("robot_mode", "timestamp", "standard_digital_output_mask"), ident=2)
    # IEEE 754: 1.5 is 3ff8...
    assert recipe.pack((7, 1.5, 255)) == bytes.fromhex("02 00000007 3ff8000000000000 ff")
