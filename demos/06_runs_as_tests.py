"""A recorded collision as a regression test in a repository of one's own, without a line of test code.

    python demos/06_runs_as_tests.py [RUN]       RUN: folder of a run, as `coneskin demo` writes it

Without RUN it first guards a virtual skin without an arm for a second. The repository is a temporary folder with one
recording, cut to what matters, and one line of settings; the plugin that coneskin brings for pytest does the rest.
"""

import json
import subprocess
import sys
import tempfile
from importlib.metadata import entry_points
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
start_s = 0.8
end_s = 1.0
u_mm = 200
phi_deg = 90

[monitoring]
skin_silence_ms = 1000
"""
SETTINGS = """
[tool.pytest.ini_options]
coneskin_runs = ["tests/runs"]
coneskin_tolerances = ["place_mm=0.1", "time_ms=1"]
"""
# an installed coneskin is found by pytest itself
PLUGIN = [] if entry_points(group="pytest11", name="coneskin") else ["-p", "coneskin.runs.pytest_plugin"]


def run(repository: Path, *words: str) -> str:
    done = subprocess.run([sys.executable, "-m", *words], cwd=repository, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def record(path: Path) -> None:
    with cs.guard(cs.parse_scene(SCENE), recording=path) as session:
        session.wait_for((cs.EventName.TOUCH_ENDED,), timeout=10.0)


def main(recorded: Path, repository: Path) -> None:
    (repository / "tests" / "runs").mkdir(parents=True)
    (repository / "pyproject.toml").write_text(SETTINGS, encoding="utf-8")
    whole = cs.read_run(recorded)
    contact = next(event for event in whole.events if event.name == cs.EventName.CONTACT)
    around = f"{contact.time - whole.start:.3f}"
    cut = repository / "tests" / "runs" / "collision.rec"
    print(run(repository, "coneskin", "runs", "cut", str(recorded.resolve()), "--around", around, "-o", str(cut)))

    print("$ pytest                     # the recording is a test")
    print(run(repository, "pytest", *PLUGIN, "-q"))

    # the events that somebody has reviewed stand beside the recording; here of a version that saw the touch elsewhere
    facts = json.loads(run(repository, "coneskin", "replay", str(cut), "--json"))
    for event in facts["events"]:
        if "u" in event:
            event["u"] -= 0.0012
    cut.with_suffix(".events.json").write_text(json.dumps({"events": facts["events"]}), encoding="utf-8")
    print("$ pytest                     # the code has changed, and a touch is seen elsewhere")
    print(run(repository, "pytest", *PLUGIN, "-q"))
    print("$ pytest --coneskin-update   # that is meant: today's events are the golden ones")
    print(run(repository, "pytest", *PLUGIN, "-q", "--coneskin-update"))
    print("$ pytest                     # and green again")
    print(run(repository, "pytest", *PLUGIN, "-q"))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 1:
            main(Path(sys.argv[1]), Path(folder))
        else:
            record(Path(folder) / "run.rec")
            main(Path(folder) / "run.rec", Path(folder) / "repository")
