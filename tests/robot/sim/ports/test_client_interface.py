"""Client interfaces: messages and states, against those that a controller of Universal Robots sent.

The bytes are those of the recorded packets in test_primary_parser.cpp of Universal Robots' client library (URSim 5.24).
"""

import struct

import pytest

from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import (
    ErrorNotice,
    Options,
    PopupNotice,
    ProgramFailed,
    ProgramNotice,
    Runtime,
    SafetyNotice,
    TextNotice,
)
from coneskin.robot.sim.ports.client_interface import (
    ScriptPort,
    _encode_notice,
    _encode_realtime,
    _encode_state,
    _encode_version,
    _realtime_size,
)
from coneskin.robot.ur.rtde_codec import SafetyMode

_TIME = bytes(8)


def test_the_start_of_a_program_is_the_recorded_key_message():
    recorded = b"\0\0\0\x32\x14" + _TIME + b"\xfe\x07" + bytes(8) + b"\x13PROGRAM_XXX_STARTEDtextmsg"
    made = _encode_notice(0.0, ProgramNotice("textmsg", "STARTED"))
    assert made[:13] == recorded[:13]
    assert made[14:] == recorded[14:]  # between them the source, which a program may have too


def test_a_name_that_does_not_exist_is_the_recorded_exception():
    text = b"compile_error_name_not_found:txtmsg:"
    recorded = b"\0\0\0\x3b\x14" + _TIME + b"\xfd\x0a\0\0\0\x03\0\0\0\x01" + text
    made = _encode_notice(0.0, ProgramFailed(text.decode(), 3, 1))
    assert made[4:] == recorded[4:]
    assert struct.unpack(">i", made[:4]) == (len(made),)


def test_a_protective_stop_is_the_recorded_safety_message_but_for_its_report():
    recorded = b"\0\0\0\x20\x14" + _TIME + b"\xfd\x05" + bytes(8) + b"\x03" + bytes(4) + b"\0\0\0\x01"
    made = _encode_notice(0.0, SafetyNotice(SafetyMode.PROTECTIVE_STOP))
    assert made[:-4] == recorded[:-4]
    assert len(made) == len(recorded)


def test_the_version_is_laid_out_as_the_recorded_one():
    recorded = b"\0\0\0\x37\x14" + _TIME + b"\xfe\x03\x09URControl\x05\x18" + bytes(8) + b"04-10-2025, 00:25:33"
    made = _encode_version(0.0, (5, 24))
    assert len(made) == len(recorded)
    assert made[:27] == recorded[:27]


def test_an_error_has_its_code_and_its_gravity():
    made = _encode_notice(1.5, ErrorNotice(153, 2, "text", 3))
    assert struct.unpack(">iBQBBiiiII", made[:35]) == (39, 20, 1_500_000, 253, 6, 153, 2, 3, 0, 0)
    assert made[35:] == b"text"


def test_a_connection_that_was_opened_in_local_control_says_c210_and_stays_read_only():
    ran, controller = [], Controller(Options(remote_control=False))
    primary = ScriptPort(controller, ran.append, messages=True)
    secondary = ScriptPort(controller, ran.append)
    for remote in (False, True):
        controller.switch_control(remote)
        assert struct.unpack(">iBQBBi", primary(b"stopj(2)\n")[:19])[-2:] == (6, 210)
        assert secondary(b"stopj(2)\n") == b""
    assert ran == []
    assert ScriptPort(controller, ran.append, messages=True)(b"stopj(2)\n") == b""
    assert ran == ["stopj(2)\n"]


def test_text_and_popup_keep_letters_of_any_language():
    assert _encode_notice(0.0, TextNotice("Größe")).endswith("Größe".encode())
    popup = _encode_notice(0.0, PopupNotice("Titel", "é", warning=True))
    assert popup[15:].endswith(b"\x01\x00\x00\x05Titel\xc3\xa9")


def test_a_title_longer_than_its_length_can_say_is_cut():
    popup = _encode_notice(0.0, PopupNotice("y" * 300, "text"))
    assert popup.count(b"y") == 255


def test_half_a_pair_of_surrogates_ends_no_controller():
    """A program in JSON may say "\\ud800", which no text in UTF-8 can hold."""
    half = "\ud800"
    assert _encode_notice(0.0, TextNotice(f"a{half}b")).endswith(b"a?b")
    for notice in (PopupNotice(half, half), ProgramNotice(half, "STARTED"), ProgramFailed(half, 1, 1)):
        assert _encode_notice(0.0, notice).endswith(b"?")
    assert _encode_notice(0.0, ErrorNotice(209, 0, half)).endswith(b"?")


#: kind of a sub-package -> its size, in the packet of 1386 bytes recorded from URSim 5.24 with a UR5e
RECORDED = {0: 47, 1: 251, 4: 101, 5: 225, 9: 53, 3: 75, 2: 37, 6: 445, 7: 61, 8: 9, 10: 43, 11: 26, 12: 8}
Q = (0.1, -1.2, 1.3, -1.4, -1.5, 0.2)


def sub_packages(packet):
    size, kind = struct.unpack(">iB", packet[:5])
    assert (size, kind) == (len(packet), 16)
    found, at = {}, 5
    while at < size:
        length, kind = struct.unpack(">IB", packet[at : at + 5])
        found[kind] = packet[at + 5 : at + length]
        at += length
    assert at == size
    return found


def test_the_first_state_has_every_sub_package_in_its_recorded_size():
    packet = _encode_state(Controller(Options(model="ur5e")), first=True)
    assert {kind: len(body) + 5 for kind, body in sub_packages(packet).items()} == RECORDED
    assert len(packet) == 1386


def test_cb3_has_a_shorter_mode_and_a_board_as_long():
    """Universal Robots' client library parses both strictly in its own tests, against PolyScope 3.14.3."""
    sizes = {
        kind: len(body) + 5 for kind, body in sub_packages(_encode_state(Controller(Options(version=(3, 15))))).items()
    }
    assert (sizes[0], sizes[3]) == (46, 75)
    assert not sizes.keys() & {11, 12}


def test_kinematics_and_configuration_come_once():
    later = sub_packages(_encode_state(Controller(Options(model="ur5e"))))
    assert later.keys() == RECORDED.keys() - {5, 6}


def test_it_says_where_the_arm_is_and_what_it_does():
    controller = Controller(Options(model="ur5e", start_q=Q))
    controller.safety, controller.slider = SafetyMode.PROTECTIVE_STOP, 0.5
    controller.update()
    state = sub_packages(_encode_state(controller))
    joints = [struct.unpack(">dddffffB", state[1][41 * i : 41 * i + 41]) for i in range(6)]
    assert [joint[0] for joint in joints] == list(Q)
    mode = struct.unpack(">Q7BBBdddB", state[0])
    assert mode[0] == round(1e6 * controller.timestamp) > 0
    assert mode[5] == 1  # protective stop
    assert (mode[8], mode[10], mode[11]) == (7, 0.5, 0.0)  # running; slider; but nothing moves
    assert state[3][-10] == 3  # safety mode, before three bytes, a word and three bytes
    tool = struct.unpack(">12d", state[4])[:3]
    assert tool == pytest.approx(controller.arm.tcp_pose().translation)


@pytest.mark.parametrize(("name", "running", "paused"), [("STOPPED", 0, 0), ("PLAYING", 1, 0), ("PAUSED", 0, 1)])
def test_it_says_whether_a_program_runs_or_is_paused(name, running, paused):
    controller = Controller(Options())
    controller.runtime = Runtime[name]
    mode = struct.unpack(">Q7BBBdddB", sub_packages(_encode_state(controller))[0])
    assert mode[6:8] == (running, paused)


def test_the_arm_is_named_as_recorded():
    """Type 1 of sub-type 3 is the recorded UR5e; its table is there too."""
    controller = Controller(Options(model="ur5e"))
    state = sub_packages(_encode_state(controller, first=True))
    numbers = struct.unpack(">53diiii", state[6])
    assert numbers[-4:] == (6, 4, 1, 3)
    assert numbers[29:35] == (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
    assert struct.unpack(">24d", state[5][24:216])[6:12] == (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
    for name, number in {"ur3e": 3, "ur10": 2, "ur16e": 4, "ur8 long": 6, "ur20": 7}.items():
        state = sub_packages(_encode_state(Controller(Options(model=name)), first=True))
        assert struct.unpack(">ii", state[6][-8:]) == (number, 3)


@pytest.mark.parametrize(("version", "size"), [((5, 25), 1220), ((5, 9), 1140), ((5, 4), 1116), ((3, 15), 1220)])
def test_a_realtime_packet_has_the_length_of_its_version(version, size):
    packet = _encode_realtime(Controller(Options(version=version)))
    assert len(packet) == size == _realtime_size(version)
    assert struct.unpack(">i", packet[:4]) == (size,)


def test_a_realtime_packet_has_its_numbers_at_their_places():
    """The places (of 8 bytes, from 1) are those that python-urx reads: q at 31, the tool at 55, its speed at 61."""
    controller = Controller(Options(model="ur5e", start_q=Q))
    controller.update()
    packet = struct.unpack(">152d", _encode_realtime(controller)[4:])
    assert packet[0] == controller.timestamp
    assert packet[1:7] == packet[31:37] == Q
    assert packet[55:58] == pytest.approx(controller.arm.tcp_pose().translation)
    assert packet[94] == 7.0  # robot mode
    assert packet[101] == packet[138] == 1.0  # safety mode, safety status
    assert packet[131] == 1.0  # program stopped
