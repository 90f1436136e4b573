"""Robot state of the client interfaces: sizes of recorded packets, values of the arm."""

import struct

import pytest

from coneskin.robot.sim.machine.options import Options
from coneskin.robot.sim.machine.safety import SafetyMode
from coneskin.robot.sim.ports.realtime_packet import encode_realtime, realtime_size
from coneskin.robot.sim.ports.robot_state import encode_first_state, encode_state, robot_type
from coneskin.robot.sim.runtime.controller import Controller

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
    packet = encode_first_state(Controller(Options(model="ur5e")))
    assert {kind: len(body) + 5 for kind, body in sub_packages(packet).items()} == RECORDED
    assert len(packet) == 1386


def test_cb3_has_a_shorter_mode_and_a_board_as_long():
    """Universal Robots' client library parses both strictly in its own tests, against PolyScope 3.14.3."""
    sizes = {
        kind: len(body) + 5 for kind, body in sub_packages(encode_state(Controller(Options(version=(3, 15))))).items()
    }
    assert (sizes[0], sizes[3]) == (46, 75)
    assert not sizes.keys() & {11, 12}


def test_kinematics_and_configuration_come_once():
    later = sub_packages(encode_state(Controller(Options(model="ur5e"))))
    assert later.keys() == RECORDED.keys() - {5, 6}


def test_it_says_where_the_arm_is_and_what_it_does():
    controller = Controller(Options(model="ur5e", start_q=Q))
    controller.safety_system.mode, controller.slider = SafetyMode.PROTECTIVE_STOP, 0.5
    state = sub_packages(encode_state(controller))
    joints = [struct.unpack(">dddffffB", state[1][41 * i : 41 * i + 41]) for i in range(6)]
    assert [joint[0] for joint in joints] == list(Q)
    mode = struct.unpack(">Q7BBBdddB", state[0])
    assert mode[5] == 1  # protective stop
    assert (mode[8], mode[10], mode[11]) == (7, 0.5, 0.0)  # running; slider; but nothing moves
    assert state[3][-10] == 3  # safety mode, before three bytes, a word and three bytes
    tool = struct.unpack(">12d", state[4])[:3]
    assert tool == pytest.approx(controller.arm.tcp_pose().translation)


def test_the_arm_is_named_as_recorded():
    """Type 1 of sub-type 3 is the recorded UR5e; its table is there too."""
    controller = Controller(Options(model="ur5e"))
    state = sub_packages(encode_first_state(controller))
    numbers = struct.unpack(">53diiii", state[6])
    assert numbers[-4:] == (6, 4, 1, 3)
    assert numbers[29:35] == (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
    assert struct.unpack(">24d", state[5][24:216])[6:12] == (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
    assert [robot_type(Controller(Options(model=name)).arm.model) for name in ("ur3e", "ur10", "ur16e", "ur20")] == [
        *(3, 2, 4, 7)
    ]


@pytest.mark.parametrize(("version", "size"), [((5, 25), 1220), ((5, 9), 1140), ((5, 4), 1116), ((3, 15), 1220)])
def test_a_realtime_packet_has_the_length_of_its_version(version, size):
    packet = encode_realtime(Controller(Options(version=version)))
    assert len(packet) == size == realtime_size(version)
    assert struct.unpack(">i", packet[:4]) == (size,)


def test_a_realtime_packet_has_its_numbers_at_their_places():
    """The places (of 8 bytes, from 1) are those that python-urx reads: q at 31, the tool at 55, its speed at 61."""
    controller = Controller(Options(model="ur5e", start_q=Q))
    controller.step()
    packet = struct.unpack(">152d", encode_realtime(controller)[4:])
    assert packet[0] == controller.timestamp
    assert packet[1:7] == packet[31:37] == Q
    assert packet[55:58] == pytest.approx(controller.arm.tcp_pose().translation)
    assert packet[94] == 7.0  # robot mode
    assert packet[101] == packet[138] == 1.0  # safety mode, safety status
    assert packet[131] == 1.0  # program stopped
