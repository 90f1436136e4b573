"""Report of the demo: the times after the touch, and what kept it from going as it should."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.commands.terminal.hints import print_hint
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import BlockKind, EventName, describe_way

if TYPE_CHECKING:
    from coneskin.core.recording.block import Block
    from coneskin.runs.replay.run import Run

__all__ = ["collision_facts", "hold_up", "print_report"]

_HELD_UP = 0.05  # s between two inputs of a kind that come 500 times a second: what a scene allows by default
_FLOW = {BlockKind.SKIN: "frames of the skin", BlockKind.ARM: "states of the arm"}


def hold_up(blocks: Iterable[Block]) -> str:
    """Return in words how long a busy computer held up what must not wait; empty where it did not.

    Args:
        blocks: of a recording.
    """
    longest: dict[str, float] = {}
    newest: dict[int, float] = {}
    for block in blocks:
        if block.kind == BlockKind.OVERRUN:
            name, late = "the guard", float(read_json(block.payload)["late"])
        elif (kind := BlockKind(block.kind) if block.kind in _FLOW else None) is not None:
            name, late = _FLOW[kind], block.time - newest.get(kind, block.time)
            newest[kind] = block.time
        else:
            continue
        longest[name] = max(longest.get(name, 0.0), late)
    held = [f"{name} for {1e3 * late:.0f} ms" for name, late in longest.items() if late > _HELD_UP]
    if not held:
        return ""
    return (
        f"this computer was too busy: it held up {', '.join(held)} ({1e3 * _HELD_UP:.0f} ms are as much as a guard "
        "should bear); end what else it does, and run the demo again"
    )


def collision_facts(run: Run, touched: float) -> dict[str, Any]:
    """Return the times after the touch [ms], and what happened."""
    events = run.events
    contact = next((e for e in events if e.name == EventName.CONTACT), None)

    def after(name: str) -> float | None:
        event = next((e for e in events if e.name == name and contact and e.time >= contact.time), None)
        return None if event is None else round(1e3 * (event.time - touched), 3)

    commands = [b.time for b in run.blocks if b.kind == BlockKind.COMMAND and contact and b.time >= contact.time]
    retreated = next((e for e in events if e.name == EventName.RETREATED), None)
    placed = next((e for e in events if e.name == EventName.CONTACT_LOCATED), contact)
    return {
        "contacts": sum(e.name == EventName.CONTACT for e in events),
        "frame_ms": after("contact"),
        "command_ms": round(1e3 * (commands[0] - touched), 3) if commands else None,
        "slower_ms": after("decelerating"),
        "standstill_ms": after("standstill"),
        "latched_ms": after("latched"),
        "retreat_mm": None if retreated is None else round(1e3 * retreated.details["progress"], 2),
        "way": None if retreated is None else describe_way(retreated.details),
        "cut_short": retreated.details["why"] if retreated is not None and not retreated.details["complete"] else None,
        "u_mm": None if placed is None else round(1e3 * placed.details["u"], 2),
        "phi_deg": None if placed is None else round(math.degrees(placed.details["phi"]), 2),
    }


def print_report(facts: dict[str, Any], folder: Path, missing: str) -> None:
    """Print the facts of a run in this folder, what its recording misses, and the next command.

    Args:
        facts: of ``collision_facts``, with forces, replay and picture.
        folder: of the run.
        missing: from the recording; empty where nothing is.
    """
    print("\nafter the touch began:")
    for key, words in (
        ("frame_ms", "frame over the threshold decoded"),
        ("command_ms", "stop written to the driver process"),
        ("slower_ms", "arm decelerating, as measured"),
        ("standstill_ms", "standstill, as measured"),
        ("latched_ms", "latched: standstill after the reaction"),
    ):
        value = facts[key]
        print(f"  {'never' if value is None else f'{value:8.2f} ms'}  {words}")
    if facts["peak_n"] is not None:
        print(f"  {facts['peak_n']:8.1f} N   peak force on the body; {facts['clamp_n']:.1f} N at most 0.5 s later")
    if facts["retreat_mm"] is not None:
        print(f"  {facts['way']}, along the normal")
    if facts["cut_short"] is not None:
        print(f"  the retreat was NOT made as far as it was to: {facts['cut_short']}; on a quieter machine it is")
    print("replay: " + ("the same events, bit by bit" if facts["same_in_replay"] else "NOT the same events"))
    if missing:
        print(f"recording: {missing}")
    print(f"written to {folder}: run.rec, scene.toml, summary.json" + (", run.png" if facts["picture"] else ""))
    print_hint(f"next: coneskin replay {shlex.quote(str(folder))} --events")
