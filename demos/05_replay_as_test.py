"""A recorded collision as a regression test: the same bytes through today's guard give the same events.

    python demos/05_replay_as_test.py [RUN]      RUN: folder of a run, as `coneskin demo` writes it

Without RUN it first guards a virtual skin without an arm for a second, and records that into a temporary folder.
"""

import sys
import tempfile
from pathlib import Path

import coneskin as cs

SCENE = """
[[link]]
name = "tube"

[[link.sensor]]
radius1_mm = 54
radius2_mm = 54
height_mm = 434

[source]
kind = "virtual"

[[source.touch]]
start_s = 0.6
end_s = 0.8
u_mm = 200
phi_deg = 90

[monitoring]
skin_silence_ms = 1000
"""


def record(path: Path) -> None:
    with cs.guard(cs.parse_scene(SCENE), recording=path) as session:
        session.wait_for((cs.EventName.TOUCH_ENDED,), timeout=10.0)


def check(path: Path) -> bool:
    run = cs.read_run(path)
    result = run.replay()
    print("\n".join(run.timeline(result.events)))
    print("the same events, bit by bit" if result.same else "NOT the same: " + "; ".join(result.differences))
    return result.same


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(not check(Path(sys.argv[1])))
    with tempfile.TemporaryDirectory() as folder:
        record(Path(folder) / "run.rec")
        sys.exit(not check(Path(folder)))
