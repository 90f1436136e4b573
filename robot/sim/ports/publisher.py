"""Publisher of the simulated controller: what goes to the clients of each port in a cycle, without being asked."""

from __future__ import annotations

from coneskin.robot.sim.machine.notices import SafetyNotice
from coneskin.robot.sim.runtime.controller import Controller

from .client_messages import encode_notice, encode_version
from .realtime_packet import encode_realtime
from .robot_state import encode_first_state, encode_state

__all__ = ["Publisher"]

_STATE_CYCLES = 50  # between two states of primary and secondary interface: 10 Hz
_REALTIME_CYCLES = {3: 4}  # major version of the software -> cycles between two packets; 1 else (CB3 has 125 Hz)


class Publisher:
    """What the client interfaces send of one controller: each packet once for all its clients."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._realtime_cycles = _REALTIME_CYCLES.get(controller.options.version[0], 1)

    def greeting(self, name: str) -> bytes:
        """Return what a new client of a port gets first."""
        c = self._controller
        if name == "realtime":
            return b""
        return encode_version(c.timestamp, c.options.version) + encode_first_state(c)

    def due(self, listening: frozenset[str]) -> dict[str, tuple[bytes, bytes]]:
        """Return what is due in this cycle: port -> state and messages for each of its clients.

        A state is worth nothing once there is a newer one; a message is sent once.

        Args:
            listening: ports that have clients; for the others nothing is made.
        """
        c = self._controller
        states: dict[str, bytes] = {}
        notices = [c.notices.popleft() for _ in range(len(c.notices))]
        changed = any(isinstance(notice, SafetyNotice) for notice in notices)  # whose state comes no later
        if (changed or c.cycle % _STATE_CYCLES == 0) and listening & {"primary", "secondary"}:
            states |= dict.fromkeys(listening & {"primary", "secondary"}, encode_state(c))
        if "realtime" in listening and c.cycle % self._realtime_cycles == 0:
            states["realtime"] = encode_realtime(c)
        due = {name: (state, b"") for name, state in states.items()}
        if "primary" in listening and notices:
            messages = b"".join([encode_notice(c.timestamp, notice) for notice in notices])
            due["primary"] = (states.get("primary", b""), messages)
        return due
