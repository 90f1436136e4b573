"""Collisions of bench `decode`, end to end: does an arm under guard ever retreat towards what presses?

In a process of its own tree, as child.py:  python -m bench.decode.collisions COUNT ANSWERS.json

Random collisions of push_in_cases.py with more than one contact (a body on the seam, a palm over it, a grip,
several fingers, two hands, a clamp), in virtual time: bytes of a virtual skin whose sheets are the exact field, the
guard's core, an arm that obeys late. Each is run with a bare stop and with a retreat; a retreat that moves any pressed
place further towards its body than the stop did has gone the wrong way.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from bench.collision.push_in import measure
from bench.collision.push_in_cases import SEVERAL, draw

MOST = 2.0  # mm; what contact supervision needs to end a motion that presses on something else


def main() -> None:
    count = int(sys.argv[1])
    found = {case: {"collisions": 0, "moved": 0, "towards": 0, "worst_mm": 0.0, "seeds": []} for case in SEVERAL}
    for seed in range(count):
        collision = draw(seed, SEVERAL)
        outcome = measure(seed, ("stop", "retreat"), "field", collision)
        excess, row = outcome["retreat"].excess(outcome["stop"]), found[collision.case]
        row["collisions"] += 1
        row["moved"] += outcome["retreat"].moved
        row["worst_mm"] = max(row["worst_mm"], excess)
        if excess > MOST:
            row["towards"] += 1
            row["seeds"].append(seed)
    Path(sys.argv[2]).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
