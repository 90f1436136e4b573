"""Facts about the boards that the pin table does not tell: how they are flashed, what their pins carry, their clocks.

Only the firmware of the Uno was run as compiled, in an emulator. What is said of the others is an estimate.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["BOARD_FACTS", "BoardFacts"]


class BoardFacts(NamedTuple):
    """What is to be known about a board."""

    title: str
    target: str  #: name of the board for ``arduino-cli``
    pin_ohms: float  #: resistance of a pin that drives to ground [ohm], typical
    pin_amperes: float  #: what such a pin may carry for good [A]
    clock_ppm: int  #: how far its clock may be off [ppm]
    rate: str  #: frames per second with the usual settings
    remark: str


#: Board, as the sketch's table names it -> its facts.
BOARD_FACTS: dict[str, BoardFacts] = {
    "uno": BoardFacts(
        "Arduino Uno R3 or Nano",
        "arduino:avr:uno",
        25.0,
        0.02,
        5000,
        "200, measured in emulation",
        "wire 3.3 V to AREF; its clock is a ceramic resonator",
    ),
    "nano-every": BoardFacts(
        "Arduino Nano Every",
        "arduino:megaavr:nona4809",
        30.0,
        0.015,
        30_000,
        "200, an estimate",
        "wire 3.3 V to AREF; its clock is the controller's own oscillator",
    ),
    "pico": BoardFacts(
        "Raspberry Pi Pico",
        "rp2040:rp2040:rpipico",
        40.0,
        0.004,
        100,
        "200, at most about 500: an estimate",
        "has three channels: an analog multiplexer brings the six to one of them",
    ),
    "teensy": BoardFacts(
        "Teensy 4.0",
        "teensy:avr:teensy40",
        40.0,
        0.004,
        100,
        "200, at most 1000: an estimate",
        "its pins do not stand more than 3.3 V",
    ),
    "esp32": BoardFacts(
        "ESP32 DevKit",
        "esp32:esp32:esp32",
        40.0,
        0.01,
        100,
        "200, at most about 500: an estimate",
        "its converter is off by per cents near both ends: calibrate, or take another board",
    ),
}
