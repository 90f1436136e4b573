"""Search for the port of a device that is unplugged and plugged in again: lists of ports go in, words come out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from coneskin.skin.sources.serial_port import PortFacts

_BY_ID = Path("/dev/serial/by-id")


class PortSearch:
    """Search of one port, which begins with the ports that are there.

    Attributes:
        found: the port, once it is known.
    """

    def __init__(self, present: Sequence[PortFacts]) -> None:
        self._present = {port.device: port for port in present}
        self._unplugged: dict[str, PortFacts] = {}
        self.found: PortFacts | None = None

    @property
    def request(self) -> str:
        """What the person has to do now."""
        if self._unplugged:
            return "plug it in again"
        return "unplug the device" if self._present else "plug the device in"

    def update(self, present: Sequence[PortFacts]) -> str:
        """Compare the ports that are there now with those before.

        Returns:
            what has changed, for the person; empty where nothing has.
        """
        now = {port.device: port for port in present}
        gone = [port for device, port in self._present.items() if device not in now]
        come = [port for device, port in now.items() if device not in self._present]
        self._present = now
        self._unplugged.update((port.device, port) for port in gone)
        if len(come) > 1:
            self._unplugged.clear()
            listing = ", ".join(port.device for port in come)
            return f"{len(come)} ports have come at once, {listing}: unplug one device only, and not a hub"
        if come:
            self.found = come[0]
            before = self._same_device(come[0])
            return f"{come[0]} has come" + (f"; it was {before} before" if before and before != come[0].device else "")
        return f"{', '.join(port.device for port in gone)} {'has' if len(gone) == 1 else 'have'} gone" if gone else ""

    def _same_device(self, port: PortFacts) -> str:
        """Return under which name the same device was there before; empty where nobody knows."""
        same = [old.device for old in self._unplugged.values() if port.hardware and old.hardware == port.hardware]
        return same[0] if len(same) == 1 else ""


def stable_name(device: str, folder: Path = _BY_ID) -> str:
    """Return a name of a port that stays when it is plugged in elsewhere; the device itself where there is none."""
    try:
        links = sorted(folder.iterdir())
    except OSError:
        return device
    return next((str(link) for link in links if link.resolve() == Path(device).resolve()), device)


def port_trouble(device: str) -> str:
    """Return why this user may not use a port, and what to do; empty where nothing stands against it."""
    if os.name != "posix" or os.access(device, os.R_OK | os.W_OK):
        return ""
    if not Path(device).exists():
        return f"{device}: no such port"
    return f"{device}: not permitted; run `sudo usermod -aG {port_group(Path(device))} $USER`, and log in again"


def port_group(device: Path) -> str:
    """Return the group whose members may use a port."""
    try:
        return device.group()
    except (KeyError, OSError, NotImplementedError):  # a number without a name; Windows has none
        return "dialout"
