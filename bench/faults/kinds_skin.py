"""Kinds of fault of the skin, while the arm moves."""

from __future__ import annotations

from .kind import FEW, FRAME, FaultKind, breaks, halt, shorted, touch, unplug, wires
from .setup import SKIN_SILENCE, STUCK
from .trial import Trial

SKIN_KINDS = (
    # nothing but a touch: the campaign's own baseline
    FaultKind("touch", touch, touched=True),
    # the skin
    FaultKind("skin silent", breaks(stall_after=0), SKIN_SILENCE),
    FaultKind("skin silent for 0.3 s", breaks(stall_after=0, stall_frames=300), SKIN_SILENCE, variant=True),
    FaultKind("skin skips 50 frames", breaks(stall_after=0, stall_frames=50), 0.05 + FEW),
    FaultKind("skin drops every third frame", breaks(drop_every=3)),
    FaultKind("skin drops every 60th frame", breaks(drop_every=60), tolerated=True, variant=True),
    FaultKind("skin corrupt, every second frame", breaks(corrupt_every=2)),
    FaultKind("skin corrupt, every frame", breaks(corrupt_every=1), SKIN_SILENCE, variant=True),
    FaultKind("skin sends garbage between frames", breaks(garbage_every=1)),
    FaultKind("skin stuck", breaks(stuck_after=0), STUCK * FRAME + FEW),
    FaultKind(
        "skin stuck, supply alone", breaks(stuck_after=0, stuck_channel="supply"), STUCK * FRAME + FEW, variant=True
    ),
    FaultKind("skin saturated", breaks(saturate_after=0)),
    FaultKind("skin saturated, one guide", breaks(saturate_after=0, stuck_channel="radial_c"), variant=True),
    FaultKind("skin stuck at zero", breaks(saturate_after=0, saturate_count=0), variant=True),
    FaultKind("skin replays what it sent", lambda t: t.skins(replay=300)),
    FaultKind("skin out of order", breaks(swap_every=2)),
    FaultKind("skin sends everything twice", breaks(duplicate_every=1), variant=True),
    FaultKind("skin cut in a frame, once", breaks(cut_after=0), tolerated=True),
    FaultKind("skin cut in a frame, then silent", breaks(cut_after=0, stall_after=1), SKIN_SILENCE, variant=True),
    FaultKind("skin later and later", lambda t: t.skins(slow=1.0), 2.0 * SKIN_SILENCE + FEW),
    FaultKind("skin's process frozen", halt("skin"), SKIN_SILENCE, after=Trial.thaw_all, variant=True),
    FaultKind("skin unplugged", unplug, variant=True),
    FaultKind("skin unplugged and back", unplug, after=lambda t: t.skins(plug=True)),
    FaultKind("skin restarts", breaks(restart_after=0)),
    FaultKind("skin's clock jumps", breaks(clock_jump_after=0)),
    FaultKind("skin reports a self-test fault", breaks(status_after=0), variant=True),
    *[FaultKind(f"wire of {name} open", wires(f"open-{name}"), variant=name != "A") for name in "ABCD"],
    shorted("A", "ground", variant=True),
    shorted("B", "ground", variant=True),
    shorted("C", "supply"),
    shorted("D", "supply", variant=True),
    shorted("A", "B"),
    shorted("C", "D", variant=True),
    shorted("A", "C", touched=True),  # one sheet on the other is what a touch is: here, a firm one in a corner
)
