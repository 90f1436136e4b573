"""Simulated controller of an xArm 6: what the maker's SDK needs to connect and to turn joints, and no more.

    python -m coneskin_xarm.simulation

Port 502 answers requests, port 30000 sends a report every 4 ms. The arm is one point after the other, without physics:
its joints follow the speeds wanted with a limited acceleration.
"""

import argparse
import selectors
import socket
import struct
import time

from coneskin.robot.arm.kinematics import forward

from . import XARM6
from .driver import REPORT_SIZE, XCONF, report

REG = XCONF.UxbusReg
VERSION = b"6,6,XI130506E42,AC130006E42,v2.5.0"
START = (0.0, -0.6, -0.7, 0.0, 1.3, 0.0)  # rad
_CYCLE = 0.004  # s
_RATE = {True: 4.0, False: 10.0}  # rad/s^2 of a motion, and of a stop
_STANDBY, _MOVING, _STOPPED = 2, 1, 4


class Controller:
    """Joints, and the state of the controller."""

    def __init__(self) -> None:
        self.q, self.qd, self.target = list(START), [0.0] * 6, [0.0] * 6
        self.state, self.mode, self.time = _STOPPED, 0, 0.0

    def step(self) -> None:
        """Go on by one cycle."""
        most = _RATE[self.state != _STOPPED] * _CYCLE
        for joint, wanted in enumerate(self.target):
            self.qd[joint] += max(-most, min(most, wanted - self.qd[joint]))
            self.q[joint] += self.qd[joint] * _CYCLE
        self.time += _CYCLE
        if self.state != _STOPPED:
            self.state = _MOVING if any(self.qd) else _STANDBY

    def report(self) -> bytes:
        """Return the report of port 30000; its layout is the SDK's."""
        found = bytearray(REPORT_SIZE)
        struct.pack_into(">IQB", found, 0, REPORT_SIZE, round(1e6 * self.time), self.state | self.mode << 4)
        empty = report(bytes(found))
        for name, values in (("joint_angle", self.q), ("joint_velocity", self.qd)):
            for of in ("target", "actual"):
                struct.pack_into("<6f", found, getattr(type(empty), f"_{of}_{name}").offset, *values)
        place = [1e3 * value for value in forward(XARM6, self.q).translation]
        struct.pack_into("<3f", found, type(empty)._actual_tcp_pose.offset, *place)
        return bytes(found)

    def answer(self, register: int, values: bytes) -> bytes:
        """Obey a request and return the values of the answer."""
        if register == REG.GET_VERSION:
            return VERSION
        if register == REG.GET_ROBOT_SN:
            return VERSION[4:].replace(b",", b"\0")
        if register == REG.GET_STATE:
            return bytes([self.state])
        if register == REG.SET_STATE:
            self.state = _STOPPED if values[0] == _STOPPED else _STANDBY
            self.target = [0.0] * 6
        elif register == REG.SET_MODE:
            self.mode = values[0]
        elif register == REG.VC_SET_JOINTV and self.state != _STOPPED:
            self.target = list(struct.unpack_from("<6f", values))
        elif register == REG.GET_JOINT_POS:
            return struct.pack("<7f", *self.q, 0.0)
        elif register == REG.GET_TCP_POSE:
            return struct.pack("<6f", *(1e3 * value for value in forward(XARM6, self.q).translation), 0.0, 0.0, 0.0)
        elif register not in (REG.MOTION_EN, REG.VC_SET_JOINTV):
            return bytes(40)  # no error, no warning, nothing set
        return b""


def serve(host: str) -> None:
    """Serve until the process ends."""
    controller, selector = Controller(), selectors.DefaultSelector()
    ports = XCONF.SocketConf.TCP_CONTROL_PORT, XCONF.SocketConf.TCP_REPORT_RT_PORT
    listeners = {socket.create_server((host, port)): port for port in ports}
    for listener in listeners:
        selector.register(listener, selectors.EVENT_READ)
    readers: list[socket.socket] = []
    rests: dict[socket.socket, bytes] = {}
    print(f"ready at {host}", flush=True)
    due = time.monotonic() + _CYCLE
    while True:
        ready = selector.select(max(0.0, due - time.monotonic()))
        now = time.monotonic()
        while due <= now:  # what a busy computer has held up is made good before what is asked now
            due += _CYCLE
            controller.step()
            for reader in list(readers):
                try:
                    reader.send(controller.report())
                except OSError:
                    readers.remove(reader)
                    reader.close()
        for key, _ in ready:
            sock = key.fileobj
            assert isinstance(sock, socket.socket)
            if sock in listeners:
                peer, _ = sock.accept()
                peer.setblocking(False)
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                if listeners[sock] == ports[1]:
                    readers.append(peer)
                else:
                    rests[peer] = b""
                    selector.register(peer, selectors.EVENT_READ)
                continue
            try:
                data = sock.recv(4096)
            except OSError:
                data = b""
            if not data:
                selector.unregister(sock)
                del rests[sock]
                sock.close()
                continue
            rests[sock] = _serve_requests(controller, sock, rests[sock] + data)


def _serve_requests(controller: Controller, sock: socket.socket, data: bytes) -> bytes:
    """Answer the whole requests at the beginning of what has come, and return the rest."""
    while len(data) >= 7:
        number, protocol, length, register = struct.unpack_from(">3HB", data)
        if len(data) < 6 + length:
            break
        values, data = data[7 : 6 + length], data[6 + length :]
        if register == 0:  # the SDK's heartbeat has no answer
            continue
        answer = controller.answer(register, values)
        try:
            sock.send(struct.pack(">3HBB", number, protocol, 2 + len(answer), register, 0) + answer)
        except OSError:
            break
    return data


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (%(default)s)")
    serve(parser.parse_args().host)
