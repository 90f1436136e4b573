"""Scene of a simulated arm whose forearm has a sensor on an emulated Uno."""

from __future__ import annotations

from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Scene
from tests.support.scenes import commissioned, forearm_scene

# what the board's page says of an Uno: its bits, the resistance of its switches, its rate on the line
_SENSOR = "adc_bits = 11\nlead_ohm = 3"
_BAUD = 500_000
# patient, as the computer that emulates board and arm at once may stall; the watchdog of the board bites after 250 ms
_LIMITS = "skin_silence_ms = 600\narm_silence_ms = 1000\nprogram_silence_ms = 1500\nescalate_ms = 250"


def board_scene(host: str, port: str) -> Scene:
    """Return the scene, commissioned.

    Args:
        host: of the simulated controller.
        port: of the board.
    """
    text = forearm_scene(
        host, port=port, reaction='kind = "retreat"\ndistance_mm = 30\nbare_side = "fast"', limits=_LIMITS
    )
    text = text.replace("xyz_mm =", f"{_SENSOR}\nxyz_mm =").replace("[arm]", "[arm]\nwatchdog_hz = 1")
    return commissioned(parse_scene(text.replace('kind = "serial"', f'kind = "serial"\nbaud = {_BAUD}')))
