"""Simulated controller of the arm: MuJoCo in real time, states on one port, commands on another.

    python -m coneskin_seven.simulation --swing

| port | what goes over it |
|---|---|
| 7701 | a state every 4 ms: ``STATE``, to whoever connects |
| 7702 | lines: ``speeds QD... ACCELERATION`` by a program; ``stop DECELERATION``; ``stops?``; ``flange?`` |
"""

import argparse
import math
import selectors
import socket
import time
from pathlib import Path

import mujoco

from .protocol import COMMAND_PORT, MARK, STATE, STATE_PORT

START = (0.3, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0)  # rad
_CYCLE = 0.004  # s
_SWING = 0.5, 2.0  # rad/s, and s to one side


class Simulation:
    """Physics and ramps of the arm."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("seven.xml")))
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = START
        mujoco.mj_forward(self.model, self.data)
        self.target, self.rate, self.running = [0.0] * 7, 4.0, False

    def step(self) -> None:
        """Go on by one cycle of the controller: the speeds wanted change by no more than the rate lets them."""
        most = self.rate * self.model.opt.timestep
        for _ in range(round(_CYCLE / self.model.opt.timestep)):
            gaps = [wanted - now for wanted, now in zip(self.target, self.data.ctrl, strict=True)]
            share = min(1.0, most / max(max(map(abs, gaps)), 1e-12))
            self.data.ctrl[:] = [now + share * gap for now, gap in zip(self.data.ctrl, gaps, strict=True)]
            mujoco.mj_step(self.model, self.data)

    def state(self) -> bytes:
        """Return the state as it is sent."""
        return STATE.pack(MARK, self.data.time, *self.data.qpos, *self.data.qvel, self.running)

    def answer(self, line: str) -> str:
        """Obey a line and return the answer."""
        word, *rest = line.split() or [""]
        numbers = [float(number) for number in rest]
        if word == "speeds" and len(numbers) == 8 and all(map(math.isfinite, numbers)):
            self.target, self.rate, self.running = numbers[:7], numbers[7], True
            return "ok"
        if word == "stop" and len(numbers) == 1 and numbers[0] > 0.0:
            self.target, self.rate, self.running = [0.0] * 7, numbers[0], False
            return "ok"
        if word == "stops?":
            return "yes"
        if word == "flange?":
            mujoco.mj_forward(self.model, self.data)
            return " ".join(map(repr, [*self.data.site("flange").xpos.tolist(), *self.data.qpos.tolist()]))
        return "unknown"


def serve(host: str, swing: bool) -> None:
    """Serve until the process ends."""
    simulation, selector = Simulation(), selectors.DefaultSelector()
    listeners = {socket.create_server((host, port)): port for port in (STATE_PORT, COMMAND_PORT)}
    for listener in listeners:
        selector.register(listener, selectors.EVENT_READ)
    readers: list[socket.socket] = []
    rests: dict[socket.socket, bytes] = {}
    if swing:
        simulation.answer(f"speeds {_SWING[0]} 0 0 0 0 0 0 2")
    print(f"ready at {host}", flush=True)
    due, turn_at = time.monotonic() + _CYCLE, time.monotonic() + _SWING[1] / 2.0
    while True:
        ready = selector.select(max(0.0, due - time.monotonic()))
        now = time.monotonic()
        while due <= now:  # what a busy computer has held up is made good before what is asked now: its clock is true
            due += _CYCLE
            if swing and simulation.running and due >= turn_at:
                turn_at += _SWING[1]
                simulation.target = [-speed for speed in simulation.target]
            simulation.step()
            for reader in list(readers):
                try:
                    reader.send(simulation.state())
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
                if listeners[sock] == STATE_PORT:
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
            *lines, rests[sock] = (rests[sock] + data).split(b"\n")
            for line in lines:
                sock.send(simulation.answer(line.decode("ascii", "replace")).encode() + b"\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (%(default)s)")
    parser.add_argument("--swing", action="store_true", help="a program of its own turns joint 1 to and fro")
    arguments = parser.parse_args()
    serve(arguments.host, arguments.swing)
