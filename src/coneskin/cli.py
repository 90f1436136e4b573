"""Command line: one command for each job; only the chosen one is imported."""

from __future__ import annotations

import argparse
import difflib
import importlib
import io
import os
import sys
from collections.abc import Sequence

from coneskin.core.version import __version__

from .commands.shell_completion import SHELLS, complete, completed_words, shell_code
from .core.errors import ConeSkinError
from .core.text import printable

__all__ = ["COMMANDS", "main"]

#: command -> module with add_arguments(parser) and run(args), and its description
COMMANDS = {
    "demo": ("coneskin.commands.demo", "simulated arm and skin: touch, stop, retreat, replay; no hardware"),
    "unroll": ("coneskin.commands.unroll", "the flat sector of a truncated cone: r1, r2, theta0"),
    "design": ("coneskin.commands.design", "sheets for a link, ready to be cut: drawings, report, sensor.toml"),
    "studio": ("coneskin.commands.studio", "design the sheets for a link in a browser: cones, handles, layers"),
    "init": ("coneskin.commands.init", "write the scene for a design, and say the next command"),
    "firmware": ("coneskin.commands.firmware", "the sketch of a board that reads a sensor, its wiring and its parts"),
    "doctor": ("coneskin.commands.doctor", "examine skin, wires and arm of a scene; each finding with its remedy"),
    "field": ("coneskin.commands.field", "draw the electric field of a sensor"),
    "calibrate": ("coneskin.commands.calibrate", "touch known places of a skin, and take off what it reads wrongly"),
    "commission": ("coneskin.commands.commission", "touch marks on a skin, so that its arm may move away from touches"),
    "find-port": ("coneskin.commands.find_port", "find the port of a device: unplug it, and plug it in again"),
    "monitor": ("coneskin.commands.monitor", "what arrives on a line, and what is wrong with it; no arm, no scene"),
    "guard": ("coneskin.commands.guard", "guard the arm of a scene"),
    "impact": ("coneskin.commands.impact", "the forces with which a scene's arm meets its bodies, in physics"),
    "permissible": ("coneskin.commands.permissible", "how fast which part of a skinned arm may move, by your limits"),
    "heartbeat": (
        "coneskin.commands.heartbeat",
        "lines with which a program on the controller ends if the guard is gone",
    ),
    "replay": ("coneskin.commands.replay", "run a recording again and compare"),
    "runs": ("coneskin.commands.runs", "recorded runs: list, check, cut, compare, export"),
    "view": ("coneskin.commands.view", "see arm, skin and touches in a browser, live or recorded; no safety display"),
    "sim-ur": ("coneskin.robot.sim.command", "a simulated UR controller that ur_rtde connects to"),
    "sim-skin": ("coneskin.skin.virtual.command", "a virtual skin that sends the bytes of a real one"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code: 0 done, 1 failed, 2 wrong usage, 130 interrupted."""
    try:
        return _run(arguments)
    except KeyboardInterrupt:  # a command is imported for up to a second before it runs
        print("coneskin: interrupted", file=sys.stderr)
        return 130


def _run(arguments: Sequence[str] | None) -> int:
    completing = completed_words()
    words = list(completing if completing is not None else sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):  # the name of a file may be no text: it is written out, as on stderr
        sys.stdout.reconfigure(errors="backslashreplace")
    parser = argparse.ArgumentParser(
        prog="coneskin",
        description="Touch-sensitive skin for robot arms: design it, guard an arm with it, replay its collisions. "
        "Not a safety-rated device.",
        epilog="example:\n  coneskin demo\n  coneskin unroll --radius1-mm 40 --radius2-mm 70 --height-mm 150",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--completion", metavar="SHELL", choices=SHELLS, help=f"print what completes the words in {', '.join(SHELLS)}"
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
    if completing is not None:
        complete(parser)
    if words[:1] == ["--completion"] and words[1:2] and words[1] in SHELLS:
        return _print_completion(words[1])
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
        print(printable(f"coneskin {args.command}: {exc}"), file=sys.stderr)
        return 1
    except BrokenPipeError:
        return _lose_reader()
    except OSError as exc:  # a disk that is full, a folder that may not be written to
        print(
            f"coneskin {args.command}: {exc.strerror or exc}{f': {exc.filename}' if exc.filename else ''}",
            file=sys.stderr,
        )
        return 1
    except KeyboardInterrupt:
        print(f"coneskin {args.command}: interrupted", file=sys.stderr)
        return 130


def _print_completion(shell: str) -> int:
    try:
        print(shell_code(shell), flush=True)
    except ConeSkinError as exc:
        print(f"coneskin: {exc}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return _lose_reader()
    return 0


def _lose_reader() -> int:
    """Take that the reader of our output has gone, as head does; return the exit code."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 1


if __name__ == "__main__":
    sys.exit(main())
