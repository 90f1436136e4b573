"""Session of one RTDE client of the simulated controller: its recipes and inputs. Bytes in, bytes out.

Rules that clients rely on: one reply for each request; no data before START; input recipes are numbered
1, 2, 3 ... on each connection; an input belongs to one connection at a time and keeps its value after it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from coneskin.robot.sim.runtime.controller import Controller
from coneskin.robot.ur.rtde_codec import (
    IN_USE,
    NOT_FOUND,
    Packet,
    PacketKind,
    Recipe,
    pack,
    split,
    split_names,
)
from coneskin.robot.ur.rtde_variables import VARIABLES

from .rtde_outputs import RtdeOutputs, available

__all__ = ["RtdeSession"]

_MIN_FREQUENCY = 1e-3  # Hz
_MAX_NAMES = 1000  # of a recipe: their values fit into a packet
_MAX_RECIPES = 255  # of inputs; a packet has one byte for the number
BUGFIX_VERSION, BUILD_NUMBER = 0, 1  #: last two numbers of the controller's version


class RtdeSession:
    """State of one RTDE connection.

    Attributes:
        started: True while outputs are sent.
    """

    def __init__(self, controller: Controller, outputs: RtdeOutputs) -> None:
        self._c = controller
        self._outputs = outputs
        self._rest = b""
        self._inputs: list[Recipe] = []
        self._recipe: Recipe | None = None
        self._getters: list[tuple[Callable[[], object], bool]] = []
        self._every = 1
        self.started = False

    def receive(self, data: bytes) -> bytes:
        """Act on bytes of the client, and return the replies."""
        packets, self._rest = split(self._rest + data)
        return b"".join([self._answer(packet) for packet in packets])

    def outputs(self) -> bytes:
        """Return the data packet of this cycle; empty if none is due."""
        if not self.started or self._recipe is None or self._c.cycle % self._every:
            return b""
        flat: list[float] = []
        for get, is_vector in self._getters:
            if is_vector:
                flat.extend(get())  # type: ignore[arg-type]
            else:
                flat.append(get())  # type: ignore[arg-type]
        return pack(PacketKind.DATA, self._recipe.pack_flat(flat))

    def close(self) -> None:
        """Release the inputs that the client owned; they keep their values."""
        owners = self._c.inputs.owners
        for name in [name for name, owner in owners.items() if owner is self]:
            del owners[name]

    def _answer(self, packet: Packet) -> bytes:
        kind, payload = packet
        if kind is PacketKind.DATA:
            self._data(payload)
            return b""
        if kind is PacketKind.PROTOCOL_VERSION:
            return pack(kind, bytes([payload == b"\x00\x02"]))
        if kind is PacketKind.CONTROLLER_VERSION:
            return pack(kind, struct.pack(">4I", *self._c.options.version, BUGFIX_VERSION, BUILD_NUMBER))
        if kind is PacketKind.OUTPUTS:
            return pack(kind, self._set_outputs(payload))
        if kind is PacketKind.INPUTS:
            return pack(kind, self._set_inputs(payload))
        if kind is PacketKind.START:
            self.started = self._recipe is not None
            return pack(kind, bytes([self.started]))
        if kind is PacketKind.PAUSE:
            self.started = False
            return pack(kind, b"\x01")
        self._c.log("client_text", text=payload.decode("latin-1"))
        return b""

    def _set_outputs(self, payload: bytes) -> bytes:
        if len(payload) < 8:
            return b"\x00"
        frequency = struct.unpack_from(">d", payload)[0]
        names = split_names(payload[8:])
        version = self._c.options.version
        types = [VARIABLES[name] if available(name, version) else NOT_FOUND for name in names]
        self.started, self._recipe = False, None
        if names and NOT_FOUND not in types and len(names) <= _MAX_NAMES:
            self._recipe = Recipe(names)
            self._getters = [
                (self._outputs.getter(name), kind.startswith("VECTOR")) for name, kind in zip(names, types, strict=True)
            ]
            self._every = max(1, round(500.0 / max(frequency, _MIN_FREQUENCY))) if frequency > 0.0 else 1
        return bytes([self._recipe is not None]) + _list(types)

    def _set_inputs(self, payload: bytes) -> bytes:
        names, owners = split_names(payload), self._c.inputs.owners
        types = []
        for name in names:
            if name not in self._c.inputs:
                types.append(NOT_FOUND)
            else:
                types.append(VARIABLES[name] if owners.get(name, self) is self else IN_USE)
        full = len(names) > _MAX_NAMES or len(self._inputs) == _MAX_RECIPES
        if not names or full or NOT_FOUND in types or IN_USE in types:
            return b"\x00" + _list(types)
        owners.update(dict.fromkeys(names, self))
        self._inputs.append(Recipe(names, ident=len(self._inputs) + 1))
        return bytes([len(self._inputs)]) + _list(types)

    def _data(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if not 1 <= number <= len(self._inputs):
            self._c.log("bad_packet", reason=f"no input recipe {number}")
            return
        recipe = self._inputs[number - 1]
        if len(payload) != recipe.size:
            self._c.log("bad_packet", reason=f"recipe {number} has {recipe.size} bytes, got {len(payload)}")
            if len(payload) < recipe.size or self._c.options.wrong_size == "drop":
                return
            payload = payload[: recipe.size]
        self._c.write_inputs(dict(zip(recipe.names, recipe.unpack(payload), strict=True)))


def _list(types: list[str]) -> bytes:
    """Return the types of a reply; of a recipe that is too long those that fit into a packet."""
    return ",".join(types[:_MAX_NAMES]).encode()
