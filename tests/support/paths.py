"""Places that tests read from: the repository, the recording of a collision, link meshes kept beside the repository."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
COLLISION = ROOT / "tests" / "data" / "collision.rec"
SHARED_DATA = ROOT.parent / "shared" / "data"
