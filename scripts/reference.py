#!/usr/bin/env python3
"""Write the tables of docs/look-up from the tables of the code.

    python scripts/reference.py            write them
    python scripts/reference.py --check    name the pages that are not what the code says; exit code 1
    python scripts/reference.py --show methods    print what is a page of the site alone: methods of ur_rtde, options

A page keeps its own text; what stands between `<!-- generated: NAME -->` and `<!-- end -->` is made here.
In docs/look-up/scene.md each section of a table of the scene has the table of its keys.
"""

from __future__ import annotations

import argparse
import ast
import importlib.util
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "look-up"
STUBS = ROOT / "src" / "coneskin" / "session" / "ur_rtde_methods.pyi"
#: first folder of a public name's module -> its group
GROUPS = {
    "design": "design",
    "geometry": "design",
    "session": "guard and replay",
    "scene": "guard and replay",
    "commissioning": "guard and replay",
    "runs": "guard and replay",
    "robot": "guard and replay",
    "skin": "skin",
    "core": "errors",
}


# scene keys


def _scene_tables() -> dict[str, tuple[Any, ...]]:
    """Return the keys of every table of a scene by its heading, in the order of the page, each with its default."""
    from coneskin.core.keys import Key, with_meanings
    from coneskin.robot.reaction.types import Reaction
    from coneskin.robot.stop.limits import MonitoringLimits
    from coneskin.scene.tables import keys
    from coneskin.scene.tables.sensor_keys import SENSOR_KEYS

    files = with_meanings(  # they are taken out of a table before its keys are checked
        """
        file: a file with more of these keys
        calibration: a calibration file, or the folder of such files. The newest one of this device and sensor applies
        """,
        Key("file", str, None),
        Key("calibration", str, None),
    )
    return {
        "[arm]": keys.ARM_KEYS,
        "[[link]]": keys.LINK_KEYS,
        "[[link.sensor]]": (*files, *SENSOR_KEYS),
        "[source]": keys.source_keys(),
        "[[source.touch]]": keys.TOUCH_KEYS,
        "[reaction]": _with_defaults(keys.REACTION_KEYS, Reaction),
        "[[reaction.rule]]": keys.RULE_KEYS,
        "[monitoring]": _with_defaults(keys.MONITORING_KEYS, MonitoringLimits),
        "[recording]": keys.RECORDING_KEYS,
        "[motion]": keys.MOTION_KEYS,
        "[commissioning]": keys.COMMISSIONING_KEYS,
        "[[body]]": keys.BODY_KEYS,
        "[padding]": keys.PADDING_KEYS,
        "[speed_limit]": keys.SPEED_LIMIT_KEYS,
        "[[speed_limit.curve]]": keys.CURVE_KEYS,
        "[[speed_limit.patch]]": keys.PATCH_KEYS,
    }


def _with_defaults(keys: Sequence[Any], settings: type) -> tuple[Any, ...]:
    """Return keys with the defaults of the dataclass that takes their values."""
    defaults = {field.name: field.default for field in fields(settings)}
    return tuple(replace(key, default=defaults[key.plain]) if key.default is None else key for key in keys)


def scene_table(keys: Sequence[Any]) -> str:
    """Return the table of the keys of one table of a scene."""
    lines = ["| key | unit | range | default | meaning |", "|---|---|---|---|---|"]
    for (*rest, meaning), alike in _rows(keys).items():
        lines.append(f"| {', '.join(f'`{name}`' for name in alike)} | {' | '.join(rest)} | {meaning} |")
    return "\n".join(lines) + "\n"


def design_tables() -> str:
    """Return the tables of the keys of design.toml. They are a page of the site alone, as the file says it."""
    from coneskin.design.design_toml import DESIGN_TABLES

    parts = (f"## `[{name}]`\n\n{meaning}\n\n{scene_table(keys)}" for name, (meaning, keys) in DESIGN_TABLES.items())
    return "\n".join(parts)


def _rows(keys: Sequence[Any]) -> dict[tuple[str, ...], list[str]]:
    """Return the cells of each row with the keys that it is for: those that another table explains stand in one."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for key in keys:
        cells = (key.unit, key.bounds, key.default_words, key.meaning)
        if re.fullmatch(r"as in `\[\w+\]`", key.meaning) and key.default_words == "as above":
            cells = ("", "", key.default_words, key.meaning)
        rows.setdefault(cells, []).append(key.name)
    return rows


# events, commands, names


def event_table() -> str:
    """Return the table of the names of events."""
    from coneskin.robot.guard.signals.journal import SESSION_EVENTS, EventName

    lines = ["| event | means |", "|---|---|"]
    lines += [f"| `{name}`{' *' if name in SESSION_EVENTS else ''} | {name.meaning} |" for name in EventName]
    return "\n".join(lines) + "\n"


def command_table() -> str:
    """Return the table of the commands."""
    from coneskin.cli import COMMANDS

    lines = ["| command | what it does |", "|---|---|"]
    lines += [f"| `coneskin {name}` | {row[1]} |" for name, row in COMMANDS.items()]
    return "\n".join(lines) + "\n"


def option_tables() -> str:
    """Return the options of each command, by its parser. They are a page of the site alone: `--help` says the same."""
    from coneskin.cli import COMMANDS

    lines = []
    for name, (module, *_) in COMMANDS.items():
        parser = argparse.ArgumentParser(prog=f"coneskin {name}")
        importlib.import_module(module).add_arguments(parser)
        lines += _options(parser)
    return "\n".join(lines).rstrip("\n") + "\n"


def _options(parser: argparse.ArgumentParser) -> Iterator[str]:
    children: list[argparse.ArgumentParser] = []
    rows = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            children = list(dict.fromkeys(action.choices.values()))
        elif action.help is not argparse.SUPPRESS and not isinstance(action, argparse._HelpAction):
            rows.append(f"| {_option(action)} | {_help(parser, action)} |")
    yield from (f"## `{parser.prog}`", "")
    if rows:
        yield from ("| option | meaning |", "|---|---|", *rows, "")
    for child in children:
        yield from _options(child)


def _option(action: argparse.Action) -> str:
    name = next((name for name in action.option_strings if name.startswith("--")), (action.option_strings or [""])[0])
    if action.nargs == 0:
        return f"`{name}`"
    value = action.metavar or (action.dest.upper() if name else action.dest)
    value = " ".join(value) if isinstance(value, tuple) else value
    return f"`{name} {value}`" if name else f"`{value}`"


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    text = parser._get_formatter()._expand_help(action) if action.help else ""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def name_table() -> str:
    """Return the public names in groups."""
    homes = importlib.import_module("coneskin")._HOMES
    groups: dict[str, list[str]] = {group: [] for group in dict.fromkeys([*GROUPS.values(), "simulation"])}
    for name, home in homes.items():
        if not name.startswith("__"):
            group = "simulation" if home.startswith(("skin.virtual", "robot.sim")) else GROUPS[home.split(".")[0]]
            groups[group].append(f"`{name}`")
    rows = [f"| {group} | {' '.join(sorted(names))} |" for group, names in groups.items()]
    return "\n".join(["| | names |", "|---|---|", *rows]) + "\n"


# ur_rtde


def _wheel_interfaces() -> dict[type, list[str]]:
    """Return the interfaces of the ur_rtde wheel that is installed, and the public methods of each."""
    import rtde_control
    import rtde_io
    import rtde_receive

    interfaces = (rtde_control.RTDEControlInterface, rtde_receive.RTDEReceiveInterface, rtde_io.RTDEIOInterface)
    return {
        interface: [name for name in dir(interface) if name[0].islower() and callable(getattr(interface, name))]
        for interface in interfaces
    }


def wheel_methods() -> dict[str, list[str]]:
    """Return the public methods of each interface of the wheel."""
    return {interface.__name__: names for interface, names in _wheel_interfaces().items()}


def method_table() -> str:
    """Return the table of ur_rtde's methods; it needs the wheel."""
    from coneskin.session.ur_rtde_names import NAMES, REFUSALS

    lines = []
    for interface, names in wheel_methods().items():
        rows: dict[tuple[str, str], list[str]] = {}  # methods that are answered alike stand in one row
        for name in names:
            if name in NAMES:
                own = NAMES[name].own.replace(f'"{name}"', '"METHOD"')
                rows.setdefault((f"`{own}`", NAMES[name].note), []).append(f"`{name}`")
            else:
                rows.setdefault(("refused", REFUSALS[name]), []).append(f"`{name}`")
        lines += [f"## {interface}", "", "| method | own name | note |", "|---|---|---|"]
        for (own, note), alike in rows.items():
            lines.append(f"| {', '.join(alike)} | {own} | {note} |".replace("|  |", "| |"))
        lines.append("")
    return "\n".join(lines).rstrip("\n") + "\n"


_STUB_HEAD = '''"""Methods of ur_rtde on ``session.arm``, for type checkers. Made by scripts/reference.py."""

from collections.abc import Sequence
from datetime import timedelta
from typing import NoReturn, overload

from typing_extensions import deprecated

class _AsyncOperationStatus:
    def isAsyncOperationRunning(self) -> bool: ...
    def progress(self) -> int: ...

class UrRtdeMethods:
'''


def method_stubs() -> str:
    """Return ur_rtde's methods on the arm for a type checker, with the signatures of the wheel, which it needs."""
    from coneskin.session.ur_rtde_names import NAMES, REFUSALS

    lines = {}
    for interface, names in _wheel_interfaces().items():
        for name in names:
            if name in REFUSALS:
                lines[name] = [f"@deprecated({json.dumps(f'refused: {REFUSALS[name]}')})"]
                lines[name] += [f"def {name}(self, *args: object, **kwargs: object) -> NoReturn: ..."]
                continue
            found = re.findall(rf"^(?:\d\. )?{name}(\(self: .*\) -> .*)$", getattr(interface, name).__doc__, re.M)
            said = "; ".join(filter(None, (NAMES[name].own, NAMES[name].note)))
            lines[name] = []
            for signature in found:
                lines[name] += ["@overload"] if len(found) > 1 else []
                lines[name] += [f"def {name}{_stub_signature(signature)}:", f'    """In coneskin: {said}."""']
    return _STUB_HEAD + "".join(f"    {line}\n" for name in sorted(lines) for line in lines[name])


def _stub_signature(text: str) -> str:
    """Return a signature of the wheel as a stub has it: any sequence will do, and arg0 is given by its place."""
    function = ast.parse(f"def f{text}: ...").body[0]
    assert isinstance(function, ast.FunctionDef)
    given = function.args
    with_default = len(given.args) - len(given.defaults)
    arguments = ["self"]
    for number, argument in enumerate(given.args[1:], 1):
        kind = _stub_type(argument.annotation).replace("list[", "Sequence[")
        arguments.append(f"{argument.arg}: {kind}{' = ...' if number >= with_default else ''}")
    arguments += ["/"] if "arg0" in text else []
    return f"({', '.join(arguments)}) -> {_stub_type(function.returns)}"


def _stub_type(kind: ast.expr | None) -> str:
    assert kind is not None
    return ast.unparse(kind).replace("rtde_control.Async", "_Async").replace("datetime.", "")


# promises


def promises() -> dict[str, str]:
    """Return the promises of docs/safety.md: id -> sentence."""
    return dict(re.findall(r"^\| (P\d\d) \| (.*) \|$", (ROOT / "docs" / "safety.md").read_text(encoding="utf-8"), re.M))


def proofs() -> dict[str, list[str]]:
    """Return the tests that carry ``@pytest.mark.promise(...)``: id -> file::test."""
    found: dict[str, list[str]] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if "mark.promise(" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            for mark in getattr(node, "decorator_list", []):
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.promise":
                    for argument in mark.args:
                        test = f"{path.relative_to(ROOT / 'tests').as_posix()}::{node.name}"  # type: ignore[attr-defined]
                        found.setdefault(ast.literal_eval(argument), []).append(test)
    return found


def proof_table() -> str:
    """Return the list of the promises, each with the tests that show it."""
    shown = proofs()
    rows = [f"* {number} {' '.join(f'`{test}`' for test in shown.get(number, []))}" for number in promises()]
    return "\n".join(rows) + "\n"


def liveness_table() -> str:
    """Return the table of who misses whom."""
    from coneskin.robot.driver.liveness import GUARD_SILENCE, SETPOINT_SILENCE, UNGUARDED_TIME

    guard, alone, moved = (f"{limit:g} s" for limit in (GUARD_SILENCE, UNGUARDED_TIME, SETPOINT_SILENCE))
    return f"""\
| silent | missed by | sign of life | limit | who misses it |
|---|---|---|---|---|
| your program | guard | it is not suspended | `program_silence_ms` | stops the arm, latches |
| driver process, watchdogs | guard | heartbeat | `4/3 program_silence_ms` | stops the arm by another path, latches |
| guard | driver process, first watchdog | heartbeat | {guard} | stops the arm |
| guard | second watchdog | heartbeat | {alone} | stops the arm, holds it |
| guard | your program | its reports | {alone} | raises RobotConnectionError |
| guard that moves the arm | driver process | setpoints | {moved} | stops the arm |
| driver process | controller | writes | `1 / watchdog_hz` | ends its program |
"""


#: page -> name of a generated part -> what makes it
PARTS: dict[str, dict[str, Callable[[], str]]] = {
    "scene.md": {},
    "events.md": {"events": event_table},
    "commands.md": {"commands": command_table},
    "public-names.md": {"names": name_table},
    "promises.md": {"proofs": proof_table, "liveness": liveness_table},
}

#: what is a page of the site alone, or is printed: name -> what makes it
SHOWN: dict[str, Callable[[], str]] = {"options": option_tables, "design": design_tables, "methods": method_table}


def page(name: str) -> str:
    """Return what a page of docs/look-up must be."""
    text = (PAGES / name).read_text(encoding="utf-8")
    for part, make in PARTS[name].items():
        begin, end = f"<!-- generated: {part} -->\n", "<!-- end -->\n"
        before, rest = text.split(begin)
        after = rest.split(end, 1)[1]
        text = before + begin + make() + end + after
    if name == "scene.md":
        for section, keys in _scene_tables().items():
            head = f"\n## `{section}`\n"
            assert head in text, f"docs/look-up/scene.md needs a section {section}"
            start = text.index("| key | unit |", text.index(head))
            stop = text.index("\n\n", start) + 1 if "\n\n" in text[start:] else len(text)
            text = text[:start] + scene_table(keys) + text[stop:]
    return text


def main() -> int:
    """Write the pages, or check them."""
    parser = argparse.ArgumentParser(description="Write the tables of docs/look-up from those of the code.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where a page differs")
    parser.add_argument("--show", choices=SHOWN, help="print a table that no page of the repository has")
    args = parser.parse_args()
    if args.show:
        print(SHOWN[args.show](), end="")
        return 0
    stale = []
    made = {PAGES / name: page(name) for name in PARTS}
    if importlib.util.find_spec("rtde_control"):  # the wheel itself says what its methods take
        made[STUBS] = method_stubs()
    for path, text in made.items():
        if text != path.read_text(encoding="utf-8"):
            if args.check:
                stale.append(f"{path.name}: run python scripts/reference.py")
            else:
                path.write_text(text, encoding="utf-8")
    if stale:
        print(*stale, sep="\n", file=sys.stderr)
    return bool(stale)


if __name__ == "__main__":
    sys.exit(main())
