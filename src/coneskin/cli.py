"""The command line: one word for each job; only the job that is asked for is imported."""

from __future__ import annotations

import argparse
import difflib
import importlib
import os
import sys
from collections.abc import Sequence

from . import __version__
from .errors import ConeSkinError

__all__ = ["COMMANDS", "main"]

#: command -> module that has add_arguments(parser) and run(args), and what it does
COMMANDS = {
    "demo": ("coneskin.demo", "simulated arm and skin: touch, stop, retreat, replay; no hardware"),
    "unroll": ("coneskin.unroll_command", "the flat sector of a truncated cone: r1, r2, theta0"),
    "design": ("coneskin.design_command", "from a link to the sheets of its sensor: cut files, report, sensor.toml"),
    "field": ("coneskin.field_command", "the electric field of a sensor, and the paper's figures from it"),
    "guard": ("coneskin.guard_command", "guard the arm of a scene"),
    "replay": ("coneskin.replay_command", "run a recording again and compare"),
    "sim-ur": ("coneskin.robot.sim_command", "a simulated UR controller that ur_rtde connects to"),
    "sim-skin": ("coneskin.skin.sim_command", "a virtual skin that sends the bytes of a real one"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code: 0 done, 1 failed, 2 wrong words, 130 interrupted."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    parser = argparse.ArgumentParser(
        prog="coneskin",
        description="Touch-sensitive skin for robot arms: design it, guard an arm with it, replay its collisions. "
        "Not a safety-rated device.",
        epilog="example:\n  coneskin demo\n  coneskin unroll --radius1-mm 40 --radius2-mm 70 --height-mm 150",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"coneskin {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    chosen = next((word for word in words if not word.startswith("-")), None)
    run = None
    for name, (module_name, help_text) in COMMANDS.items():
        child = commands.add_parser(name, help=help_text, description=help_text[0].upper() + help_text[1:] + ".")
        if name == chosen:
            module = importlib.import_module(module_name)
            module.add_arguments(child)
            run = module.run
    if not words:
        parser.print_help(sys.stderr)
        return 2
    if chosen is not None and run is None and chosen == words[0]:
        near = difflib.get_close_matches(chosen, COMMANDS, 1, 0.5)
        parser.error(
            f"there is no command {chosen}; "
            + (f"did you mean {near[0]}?" if near else f"there are {', '.join(COMMANDS)}")
        )
    args = parser.parse_args(words)
    assert run is not None  # argparse has ended the program otherwise
    try:
        return int(run(args))
    except ConeSkinError as exc:
        print(f"coneskin {args.command}: {exc}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of our output has gone, as head does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as exc:  # a disk that is full, a folder that may not be written to
        print(
            f"coneskin {args.command}: {exc.strerror or exc}{f': {exc.filename}' if exc.filename else ''}",
            file=sys.stderr,
        )
        return 1
    except KeyboardInterrupt:
        print(f"coneskin {args.command}: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
