"""Publisher of the simulated controller: what goes to the clients of each port in a cycle, without being asked."""

from __future__ import annotations

from coneskin.robot.sim.controller import Controller
from coneskin.robot.sim.notices import SafetyNotice

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

    def due(self, listening: frozenset[str]) -> dict[str, bytes]:
        """Return what is due in this cycle: port -> bytes for each of its clients.

        Args:
            listening: ports that have clients; for the others nothing is made.
        """
        c, made = self._controller, {}
        notices = [c.notices.popleft() for _ in range(len(c.notices))]
        if "primary" in listening and notices:
            made["primary"] = b"".join([encode_notice(c.timestamp, notice) for notice in notices])
        changed = any(isinstance(notice, SafetyNotice) for notice in notices)  # whose state comes no later
        if (changed or c.cycle % _STATE_CYCLES == 0) and listening & {"primary", "secondary"}:
            state = encode_state(c)
            made |= {name: state + made.get(name, b"") for name in listening & {"primary", "secondary"}}
        if "realtime" in listening and c.cycle % self._realtime_cycles == 0:
            made["realtime"] = encode_realtime(c)
        return made
