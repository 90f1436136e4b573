"""Messages of the primary interface, against those that a controller of Universal Robots sent.

The bytes are those of the recorded packets in test_primary_parser.cpp of Universal Robots' client library (URSim 5.24).
"""

import struct

from coneskin.robot.sim.machine.notices import (
    ErrorNotice,
    PopupNotice,
    ProgramFailed,
    ProgramNotice,
    Report,
    SafetyNotice,
    TextNotice,
)
from coneskin.robot.sim.machine.safety import SafetyMode
from coneskin.robot.sim.ports.client_messages import encode_notice, encode_version

_TIME = bytes(8)


def test_the_start_of_a_program_is_the_recorded_key_message():
    recorded = b"\0\0\0\x32\x14" + _TIME + b"\xfe\x07" + bytes(8) + b"\x13PROGRAM_XXX_STARTEDtextmsg"
    made = encode_notice(0.0, ProgramNotice("textmsg", "STARTED"))
    assert made[:13] == recorded[:13]
    assert made[14:] == recorded[14:]  # between them the source, which a program may have too


def test_a_name_that_does_not_exist_is_the_recorded_exception():
    text = b"compile_error_name_not_found:txtmsg:"
    recorded = b"\0\0\0\x3b\x14" + _TIME + b"\xfd\x0a\0\0\0\x03\0\0\0\x01" + text
    made = encode_notice(0.0, ProgramFailed(text.decode(), 3, 1))
    assert made[4:] == recorded[4:]
    assert struct.unpack(">i", made[:4]) == (len(made),)


def test_a_protective_stop_is_the_recorded_safety_message_but_for_its_report():
    recorded = b"\0\0\0\x20\x14" + _TIME + b"\xfd\x05" + bytes(8) + b"\x03" + bytes(4) + b"\0\0\0\x01"
    made = encode_notice(0.0, SafetyNotice(SafetyMode.PROTECTIVE_STOP))
    assert made[:-4] == recorded[:-4]
    assert len(made) == len(recorded)


def test_the_version_is_laid_out_as_the_recorded_one():
    recorded = b"\0\0\0\x37\x14" + _TIME + b"\xfe\x03\x09URControl\x05\x18" + bytes(8) + b"04-10-2025, 00:25:33"
    made = encode_version(0.0, (5, 24))
    assert len(made) == len(recorded)
    assert made[:27] == recorded[:27]


def test_an_error_has_its_code_and_its_gravity():
    made = encode_notice(1.5, ErrorNotice(153, 2, Report.VIOLATION, "text"))
    assert struct.unpack(">iBQBBiiiII", made[:35]) == (39, 20, 1_500_000, 253, 6, 153, 2, 3, 0, 0)
    assert made[35:] == b"text"


def test_text_and_popup_keep_letters_of_any_language():
    assert encode_notice(0.0, TextNotice("Größe")).endswith("Größe".encode())
    popup = encode_notice(0.0, PopupNotice("Titel", "é", warning=True))
    assert popup[15:].endswith(b"\x01\x00\x00\x05Titel\xc3\xa9")


def test_a_title_longer_than_its_length_can_say_is_cut():
    popup = encode_notice(0.0, PopupNotice("y" * 300, "text"))
    assert popup.count(b"y") == 255


def test_half_a_pair_of_surrogates_ends_no_controller():
    """A program in JSON may say "\\ud800", which no text in UTF-8 can hold."""
    half = "\ud800"
    assert encode_notice(0.0, TextNotice(f"a{half}b")).endswith(b"a?b")
    for notice in (PopupNotice(half, half), ProgramNotice(half, "STARTED"), ProgramFailed(half, 1, 1)):
        assert encode_notice(0.0, notice).endswith(b"?")
    assert encode_notice(0.0, ErrorNotice(209, 0, Report.WARNING, half)).endswith(b"?")
