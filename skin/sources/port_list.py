"""List of the serial ports that are there, through pyserial."""

from __future__ import annotations

from typing import NamedTuple

from coneskin.core.errors import MissingExtra

__all__ = ["PortFacts", "find_ports", "list_ports"]


class PortFacts(NamedTuple):
    """A serial port that is there."""

    device: str  #: such as /dev/ttyUSB0 or COM3
    description: str  #: for people; empty where the system has none
    hardware: str  #: what ``hwgrep://`` can look for: vendor, product and serial number; empty likewise

    def __str__(self) -> str:
        """Return it as one line."""
        facts = [fact for fact in (self.description, self.hardware) if fact]
        return self.device + (f" ({', '.join(facts)})" if facts else "")


def find_ports() -> list[PortFacts]:
    """Return the serial ports that are there, in the order of their names.

    Raises:
        MissingExtra: pyserial is not installed.
    """
    try:
        from serial.tools import list_ports as tools
    except ImportError as error:
        raise MissingExtra("pyserial", "listing serial ports") from error
    found = []
    for port in sorted(tools.comports()):
        description = port.description if port.description not in (None, "n/a", port.name) else ""
        found.append(PortFacts(port.device, description, port.hwid if port.hwid not in (None, "n/a") else ""))
    return found


def list_ports() -> list[str]:
    """Return the serial ports that are there, one line each.

    Raises:
        MissingExtra: pyserial is not installed.
    """
    return [str(port) for port in find_ports()]
