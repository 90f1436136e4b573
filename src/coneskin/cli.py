"""Command line: one command for each job; only the chosen one is imported."""

from __future__ import annotations

import argparse
import importlib
import io
import os
import re
import sys
from collections.abc import Sequence

from .core.errors import ConeSkinError, MissingExtra
from .core.help_text import HelpFormatter
from .core.text import printable, suggest
from .core.version import __version__, code_build

_SHELLS = ("bash", "zsh", "fish", "powershell")
_COMPLETION_VARIABLE = "_ARGCOMPLETE"  # set by the code of the shell
_LINE_VARIABLE = "COMP_LINE"  # what was typed so far


def _complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell and end the process; return where argcomplete is not installed."""
    try:
        import argcomplete
    except ImportError:
        return
    argcomplete.autocomplete(parser)


#: heading -> its commands, each with what it does in plain words; its module follows from its name
_GROUPS = {
    "design a skin": {
        "unroll": "unroll a truncated cone into its flat sheet: r1, r2, theta0",
        "design": "design the sheets for a link: drawings to cut, a report, sensor.toml",
        "studio": "design the sheets for a link in a browser",
        "firmware": "write the sketch, the wiring and the parts list of a board that reads a sensor",
        "field": "draw the electric field of a sensor",
    },
    "set it up": {
        "init": "write the scene for a design, and name the next command",
        "find-port": "find the port of a device: unplug it, then plug it in again",
        "monitor": "show what arrives on a serial line, and what is wrong with it; needs no scene",
        "doctor": "check a scene, its skin, its wires and its arm, and say how to mend each fault",
        "calibrate": "calibrate a skin from touches at known points",
        "commission": "test a mounted skin by touching marks, so that its arm may move away from touches",
        "permissible": "compute the maximum speed of each part of the arm from your force limits",
        "heartbeat": "print the lines that end a program on the controller when its guard is gone",
    },
    "guard an arm": {
        "guard": "guard the arm of a scene",
        "view": "show arm, skin and touches in a browser, live or recorded; not a safety display",
        "demo": "watch a simulated arm stop and retreat when it is touched; needs no hardware",
        "impact": "simulate the forces with which an arm hits the bodies of its scene",
        "sim-ur": "simulate a UR controller for ur_rtde",
        "sim-skin": "simulate a skin that sends the bytes of a real one",
    },
    "look into runs": {
        "replay": "replay recorded runs, and compare what the guard decides",
        "runs": "list, check, cut, compare, export and prune recorded runs",
    },
}
_OTHER_MODULES = {"sim-ur": "coneskin.robot.sim.command", "sim-skin": "coneskin.skin.virtual.command"}
#: command -> module with add_arguments(parser) and run(args), and its description
COMMANDS = {
    name: (_OTHER_MODULES.get(name, f"coneskin.commands.{name.replace('-', '_')}"), text)
    for commands in _GROUPS.values()
    for name, text in commands.items()
}


def _listing() -> str:
    """Return the commands by their groups, for the help."""
    lines = []
    for heading, commands in _GROUPS.items():
        lines += [f"\n  {heading}:", *(f"    {name:<12}  {text}" for name, text in commands.items())]
    return "\n".join(lines)


_CHECK_WORDS = {"check", "validate", "verify"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code: 0 done, 1 failed, 2 wrong usage, 130 interrupted."""
    try:
        return _run(arguments)
    except KeyboardInterrupt:  # a command is imported for up to a second before it runs
        print("coneskin: interrupted", file=sys.stderr)
        return 130


def _run(arguments: Sequence[str] | None) -> int:
    # the words typed so far after the program's name, where a shell asks for a completion
    completing = os.environ.get(_LINE_VARIABLE, "").split()[1:] if _COMPLETION_VARIABLE in os.environ else None
    words = list(completing if completing is not None else sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):  # the name of a file may be no text: it is written out, as on stderr
        sys.stdout.reconfigure(errors="backslashreplace")
    parser = argparse.ArgumentParser(
        prog="coneskin",
        usage="coneskin [-h] [--version] [--completion SHELL] COMMAND ...",
        description="Touch-sensitive skin for robot arms: design it, guard an arm with it, replay its collisions.\n"
        f"Not a safety-rated device.\n{_listing()}",
        epilog="example:\n  coneskin demo\n  coneskin unroll --radius1-mm 40 --radius2-mm 70 --height-mm 150",
        formatter_class=HelpFormatter,
    )
    parser.add_argument(
        "--completion", metavar="SHELL", choices=_SHELLS, help=f"print the completion code of {', '.join(_SHELLS)}"
    )
    parser.add_argument("--version", action="version", version=f"coneskin {__version__} ({code_build()})")
    said = "one of the above; `coneskin COMMAND --help` explains it"
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, prog="coneskin", help=said)
    chosen = next((word for word in words if not word.startswith("-")), None)
    run = None
    for name, (module_name, help_text) in COMMANDS.items():
        child = commands.add_parser(
            name,
            description=help_text[0].upper() + help_text[1:] + ".",
            formatter_class=HelpFormatter,
            allow_abbrev=False,
        )
        if name == chosen:
            module = importlib.import_module(module_name)
            child.epilog = (module.__doc__ or "").partition("\n\n")[2]  # what is below a module's first line
            module.add_arguments(child)
            run = module.run
    if completing is not None:
        _complete(parser)
    if words[:1] == ["--completion"] and words[1:2] and words[1] in _SHELLS:
        return _print_completion(words[1])
    if not words:
        parser.print_help(sys.stderr)
        return 2
    if chosen is not None and run is None and chosen == words[0]:
        said = "coneskin doctor SCENE --check does that" if chosen in _CHECK_WORDS else suggest(chosen, COMMANDS)
        parser.error(f"there is no command {chosen}; {said}")
    args, unknown = parser.parse_known_args(words)
    assert chosen is not None  # argparse has ended the program otherwise
    assert run is not None
    if unknown:
        command = commands.choices[chosen]
        options = re.findall(r"--[\w-]+", command.format_usage()) if unknown[0].startswith("--") else []
        said = f"; {suggest(unknown[0].partition('=')[0], options)}" if options else ""
        command.error(f"unrecognized arguments: {' '.join(unknown)}{said}")
    try:
        code = int(run(args))
        print(end="", flush=True)  # not at the end of Python, which tells of a reader that is gone
        return code
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
    """Print what a shell runs at its start, so that it completes the words of `coneskin`."""
    try:
        from argcomplete.shell_integration import shellcode

        print(shellcode(["coneskin"], shell=shell), flush=True)
    except ImportError:
        print(f"coneskin: {MissingExtra('argcomplete', 'completion in a shell', 'completion')}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return _lose_reader()
    return 0


def _lose_reader() -> int:
    """Return the exit code where the reader of the output has gone, as head does."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 1


if __name__ == "__main__":
    sys.exit(main())
