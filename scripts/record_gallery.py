"""Record the gallery: named situations in virtual time, each a run that `coneskin replay gallery:NAME` replays.

python scripts/record_gallery.py                  all recordings and pictures
python scripts/record_gallery.py --only palm      that one

The virtual skin's bytes, the guard's core and a mock arm, one millisecond after the other: the same seed gives the same
bytes. A change of what the guard decides or reports makes the recordings old, as tests/runs/test_gallery.py says.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, replace
from math import radians
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from PIL import Image  # noqa: E402

from coneskin.core.recording.block import Block  # noqa: E402
from coneskin.core.recording.recorder import Recorder  # noqa: E402
from coneskin.core.version import code_versions  # noqa: E402
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent, encode_command  # noqa: E402
from coneskin.runs.replay.run import read_run  # noqa: E402
from coneskin.runs.replay.run_picture import draw_run  # noqa: E402
from coneskin.scene.build import build_core  # noqa: E402
from coneskin.scene.reader import parse_scene  # noqa: E402
from coneskin.scene.values.scene import Commissioning  # noqa: E402
from coneskin.skin.virtual.circuit import WiringFaults  # noqa: E402
from coneskin.skin.virtual.fault_injection import FaultInjection  # noqa: E402
from coneskin.skin.virtual.scripted_touch import ScriptedTouch  # noqa: E402
from coneskin.skin.virtual.skin import VirtualSkin  # noqa: E402
from tests.support.guard_rig import GuardRig  # noqa: E402

RECORDINGS = ROOT / "src" / "coneskin" / "runs" / "gallery"
PICTURES = ROOT / "docs" / "images"
SEED = 20260101
SPEED = 0.6  # rad/s, of the base
DURATION = 1.6  # s
SCENE = """\
[arm]
model = "UR5e"
host = "127.0.0.1"

[[link]]
name = "forearm"

[[link.sensor]]
name = "forearm skin"
radius1_mm = 37.6
radius2_mm = 37.3
height_mm = 240
xyz_mm = [0, -0.4, 100]

[source]
kind = "virtual"
rate_hz = 500

"""
REACTIONS = {
    "stop": '[reaction]\nkind = "stop"\n',
    "retreat": '[reaction]\nkind = "retreat"\ndistance_mm = 20\nbare_side = "fast"\n',
}
#: situation -> what touches the skin, and what goes wrong
SITUATIONS: dict[str, tuple[tuple[ScriptedTouch, ...], FaultInjection | None]] = {
    "hand": ((ScriptedTouch(0.8, 1.3, 0.13, radians(90), 0.6, grown_force=8.0, growth_time=0.1),), None),
    "palm": ((ScriptedTouch(0.8, 1.3, 0.12, radians(2), 12.0, radius=0.012),), None),
    "grip": (
        (
            ScriptedTouch(0.8, 1.3, 0.12, radians(90), 8.0),
            ScriptedTouch(0.81, 1.3, 0.10, radians(250)),
            ScriptedTouch(0.81, 1.3, 0.14, radians(270)),
        ),
        None,
    ),
    "slide": ((ScriptedTouch(0.8, 1.4, 0.06, radians(90), 4.0, slide_u=0.09, slide_phi=radians(60)),), None),
    "wire": ((), FaultInjection(wiring_after=400, wiring=WiringFaults(opened=("B",)))),
}


STOPPED = ("slide",)  # situations in which the arm only stops, so that the touch goes on


class Recording(GuardRig):
    """Rig whose blocks and events stand in the order in which a session records them."""

    def __init__(self, reaction: str, touches: tuple[ScriptedTouch, ...], faults: FaultInjection | None) -> None:
        super().__init__(speed=SPEED)
        self.touches = touches
        self.scene = replace(
            parse_scene(SCENE + REACTIONS[reaction], "scene.toml"), commissioning=Commissioning(True, "virtual touches")
        )
        assert self.scene.source is not None
        sensors = [item.sensor for item in self.scene.sensors]
        rate = self.scene.source.settings["rate"]
        self.core = build_core(self.scene)
        self.skin = VirtualSkin(sensors, touches, rate_hz=rate, seed=SEED, faults=faults)
        self._packets = self._every_second_step(self.skin.packets())
        self.recorded: list[Block] = []

    @staticmethod
    def _every_second_step(packets):
        for packet in packets:
            yield packet
            yield packet[0], b""

    def _take(self, block: Block) -> list[object]:
        out = super()._take(block)
        commands = [output for output in out if not isinstance(output, GuardEvent)]
        sent = [encode_command(command, "driver") for command in commands]
        self.recorded += [block, *(Block(BlockKind.COMMAND, block.time, payload) for payload in sent)]
        self.recorded += [output.block() for output in out if isinstance(output, GuardEvent)]
        return out

    def beginning(self) -> tuple[Block, Block]:
        """Header, and with what the skin is touched."""
        scene = self.scene
        header = {"scene": scene.text, "name": scene.name, "folder": ".", "commissioning": asdict(scene.commissioning)}
        facts = {**header, **code_versions(), "clocks": {"monotonic": 100.0, "unix": 1767225600.0}}
        truth = [{**asdict(touch), "start": 100.0 + touch.start, "end": 100.0 + touch.end} for touch in self.touches]
        return (
            Block(BlockKind.HEADER, 100.0, json.dumps(facts).encode()),
            Block(BlockKind.TRUTH, 100.0, json.dumps({"touches": truth}).encode()),
        )


def record(name: str, target: Path) -> None:
    """Record a situation."""
    rig = Recording("stop" if name in STOPPED else "retreat", *SITUATIONS[name])
    rig.run(DURATION)
    target.unlink(missing_ok=True)
    with Recorder(target) as recorder:
        recorder.write(*rig.beginning(), *rig.recorded)


def main() -> None:
    """Record, draw, and say what happened."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(SITUATIONS))
    parser.add_argument("--recordings", type=Path, default=RECORDINGS)
    parser.add_argument("--pictures", type=Path, default=PICTURES)
    args = parser.parse_args()
    args.recordings.mkdir(exist_ok=True)
    for name in args.only.split(","):
        path = args.recordings / f"{name}.rec"
        record(name, path)
        run = read_run(path)
        picture = args.pictures / f"gallery-{name}.png"
        draw_run(run, picture)
        with Image.open(picture) as drawn:
            small = drawn.convert("RGB").quantize(48, dither=Image.Dither.NONE)
        small.save(picture, optimize=True)
        print(f"{name}: {path.stat().st_size} bytes, {run.replay().verdict}")
        print(*run.timeline(run.events), sep="\n")


if __name__ == "__main__":
    main()
