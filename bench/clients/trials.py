"""Clients that others wrote, against the simulated controller: client x test -> pass or fail, and whose fault it is.

    python -m bench ur-clients [--urcl BUILD [--source SOURCE]] [--rtde-client FOLDER] [--urx FOLDER] [--wheels FOLDER]
                               [--only WORD,...] [--keep FILE] [--json]

| option, and environment variable | |
|---|---|
| ``--urcl``, URCL_BUILD | build of Universal Robots' C++ client library (github \
UniversalRobots/Universal_Robots_Client_Library) with ``-DBUILDING_TESTS=ON -DINTEGRATION_TESTS=ON`` |
| ``--source``, URCL_SOURCE | its source, where that is not the folder above the build |
| ``--rtde-client``, RTDE_CLIENT | folder of Universal Robots' RTDE_Python_Client_Library; its examples run |
| ``--urx``, PYTHON_URX | folder of python-urx, with math3d below version 4 beside it or installed |
| ``--wheels``, UR_RTDE_WHEELS | folder of ur_rtde's wheels, from ``pip download --no-deps ur-rtde==1.5.8 -d FOLDER`` |

Nothing of these is fetched here, and what is not given is skipped, with the reason. The installed ur_rtde needs no
path and runs always. A test that fails is tried again by itself, with a controller of its own, and its row says so. The
exit code is 0 where EXPLAINED explains each failure by what is not the controller's fault.

Some tests expect that nothing answers at 192.168.56.100 and .123, and port 80 must be free: where ``unshare``
(util-linux) can make one, all runs in a network of its own that has nothing but its loopback.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from bench import report

from .python import rtde_client, urx
from .urcl import Trial, urcl
from .wheels import installed_wheel, wheels

#: words of a test's name, or of what it said -> whose fault its failure is, and the evidence
EXPLAINED_FAILURES: dict[str, str] = {
    "Did not receive a valid data packet from robot in 0.5": (
        "The machine's: the client gives up after 0.5 s without a packet (ursecmon.py, wait); beside a load of 14 for "
        "each core the simulator stood still for up to 1.2 s. At half of that load the test passed."
    ),
    "getDataPackage(data_pkg)": (
        "The machine's: the client gives up after 0.1 s without an RTDE packet (ur_driver.cpp, get_packet_timeout_)."
    ),
    "between expected_joint_positions[i] and joint_positions[i] is 0.0": (
        "The machine's: the client keeps only the newest RTDE packet (rtde_client.cpp, new_data_), and the test begins "
        "the expected curve of a segment with the first that it sees: a quintic one 10 ms late is 0.024 rad off."
    ),
    "Program did not start running": (
        "The machine's: the client gives up 0.5 s after it has sent its program (example_robot_wrapper.cpp)."
    ),
}


def explain(trial: Trial) -> str:
    """Return whose fault a failure is, and the evidence; empty where that is not known."""
    return next(
        (why for words, why in EXPLAINED_FAILURES.items() if words in f"{trial.client} {trial.test} {trial.why}"), ""
    )


def show(trials: Iterable[Trial]) -> None:
    """Show counts for each client, and what did not pass at the first try."""
    counts: dict[str, Counter[str]] = {}
    rest = []
    for trial in trials:
        result = "later" if trial.result == "pass" and trial.why else trial.result
        counts.setdefault(trial.client, Counter())[result] += 1
        if result in ("later", "fail"):
            why = explain(trial) or f"not explained: {trial.why}"
            rest.append([trial.client, trial.test, result, " ".join(why.split())[:80]])
    of_all = sum(counts.values(), Counter())
    judged = of_all["pass"] + of_all["later"] + of_all["fail"]
    title = f"{of_all['pass']} of {judged} pass at the first try, {of_all['later']} at the second or third"
    heads = {"pass": "first try", "later": "later", "fail": "fail", "skip": "skipped", "apart": "has its own server"}
    rows = [[client, *(count[name] for name in heads)] for client, count in counts.items()]
    report.show(title, ["client", *heads.values()], rows)
    if rest:
        report.show("not at the first try", ["client", "test", "result", "whose fault, and the evidence"], rest)


_IN_OWN_NETWORK = "UR_CLIENTS_IN_OWN_NETWORK"  # environment variable that says so


def enter_own_network() -> None:
    """Start this program again in a network that has nothing but its loopback, where that is possible."""
    user = ["--map-root-user"] if os.geteuid() else []  # root stays root, and may give the controller its precedence
    inner = ["unshare", *user, "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh"]
    if os.environ.get(_IN_OWN_NETWORK) or shutil.which("unshare") is None or shutil.which("ip") is None:
        return
    if subprocess.run([*inner, "true"], capture_output=True, check=False).returncode == 0:
        os.environ[_IN_OWN_NETWORK] = "1"
        os.execvp("unshare", [*inner, sys.executable, *sys.orig_argv[1:]])


def run_all(args: argparse.Namespace) -> Iterator[Trial]:
    """Run what the options ask for, and say what is skipped."""
    only = args.only.split(",")
    if args.urcl is None:
        skip("Universal Robots' client library", "--urcl BUILD or URCL_BUILD")
    else:
        yield from urcl(args.urcl, args.source or args.urcl.parent, only)
    for name, how, folder, trials in (
        ("the official RTDE client", "--rtde-client FOLDER or RTDE_CLIENT", args.rtde_client, rtde_client),
        ("python-urx", "--urx FOLDER or PYTHON_URX", args.urx, urx),
        ("other versions of ur_rtde", "--wheels FOLDER or UR_RTDE_WHEELS", args.wheels, wheels),
    ):
        if folder is None:
            skip(name, how)
        elif any(word in name for word in only):
            yield from trials(folder)
    if any(word in "ur_rtde wheel" for word in only):
        yield from installed_wheel()


def skip(name: str, how: str) -> None:
    """Say on one line that a client is skipped, and what it wants."""
    print(f"skipped: {name}, which nothing here fetches; give {how}", file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option, variable, metavar in (
        ("--urcl", "URCL_BUILD", "BUILD"),
        ("--source", "URCL_SOURCE", "SOURCE"),
        ("--rtde-client", "RTDE_CLIENT", "FOLDER"),
        ("--urx", "PYTHON_URX", "FOLDER"),
        ("--wheels", "UR_RTDE_WHEELS", "FOLDER"),
    ):
        given = os.environ.get(variable)
        parser.add_argument(option, type=Path, metavar=metavar, default=Path(given).resolve() if given else None)
    parser.add_argument(
        "--only", default="", metavar="WORD,...", help="programs, or clients, whose name has one of these words"
    )
    parser.add_argument(
        "--keep", type=Path, metavar="FILE", help="add each result to this file, and show all that it has"
    )
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    enter_own_network()
    trials = []
    if args.keep and args.keep.exists():
        trials = [Trial(**json.loads(line)) for line in args.keep.read_text().splitlines()]
    for trial in run_all(args):
        trials.append(trial)
        if args.keep:
            with args.keep.open("a") as file:
                file.write(json.dumps(trial._asdict()) + "\n")
    if args.json:
        print(json.dumps([trial._asdict() for trial in trials]))
    else:
        print(report.head("ur_rtde", "urx"))
        show(trials)
    return 1 if any(trial.result == "fail" and not explain(trial) for trial in trials) else 0
