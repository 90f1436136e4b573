#!/usr/bin/env python3
"""Write the table of ur_rtde's methods into docs/do/ur-rtde.md, from the wheel that is installed.

python scripts/ur_rtde_table.py
"""

from __future__ import annotations

from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "do" / "ur-rtde.md"
BEGIN, END = "<!-- methods -->\n", "<!-- end of methods -->\n"


def public_methods() -> dict[str, list[str]]:
    """Return the interfaces of the wheel, and the public methods of each."""
    import rtde_control
    import rtde_io
    import rtde_receive

    interfaces = (rtde_control.RTDEControlInterface, rtde_receive.RTDEReceiveInterface, rtde_io.RTDEIOInterface)
    return {
        interface.__name__: [
            name for name in dir(interface) if name[0].islower() and callable(getattr(interface, name))
        ]
        for interface in interfaces
    }


def table() -> str:
    """Return the table in Markdown."""
    from coneskin.session.ur_rtde_names import NAMES
    from coneskin.session.ur_rtde_refusals import REFUSALS

    lines = ["| method | on `session.arm` | |", "|---|---|---|"]
    for interface, names in public_methods().items():
        lines.append(f"| **{interface}** | | |")
        for name in names:
            if name in NAMES:
                lines.append(f"| `{name}` | the same; own name `{NAMES[name].own}` | {NAMES[name].note} |")
            else:
                lines.append(f"| `{name}` | refused | {REFUSALS[name]} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    PAGE.write_text(before + BEGIN + table() + END + rest.split(END)[1], encoding="utf-8")
