"""Collisions of bench `decode`, end to end: does an arm under guard ever retreat towards what presses?

Random collisions of push_in_cases.py with more than one contact (a body on the seam, a palm over it, a grip,
several fingers, two hands, a clamp), in virtual time: bytes of a virtual skin whose sheets are the exact field, the
guard's core, an arm that obeys late. Each is run with a bare stop and with a retreat; a retreat that moves any pressed
place further towards its body than the stop did has gone the wrong way.
"""

from __future__ import annotations

from typing import Any

from bench.collision.push_in import measure
from bench.collision.push_in_cases import SEVERAL_CASES, draw

MAX_EXCESS = 2.0  # mm; what contact supervision needs to end a motion that presses on something else


def collide(count: int) -> list[list[str]]:
    """Return a row for each kind of collision: collisions, motions away, towards a body, worst [mm], seeds."""
    found: dict[str, dict[str, Any]] = {
        case: {"collisions": 0, "moved": 0, "towards": 0, "worst": 0.0, "seeds": []} for case in SEVERAL_CASES
    }
    for seed in range(count):
        collision = draw(seed, SEVERAL_CASES)
        outcome = measure(seed, ("stop", "retreat"), "field", collision)
        excess, row = outcome["retreat"].excess(outcome["stop"]), found[collision.case]
        row["collisions"] += 1
        row["moved"] += outcome["retreat"].moved
        row["worst"] = max(row["worst"], excess)
        if excess > MAX_EXCESS:
            row["towards"] += 1
            row["seeds"].append(seed)
    return [
        [
            case,
            *(str(row[word]) for word in ("collisions", "moved", "towards")),
            f"{row['worst']:.1f}",
            str(row["seeds"]),
        ]
        for case, row in found.items()
    ]
