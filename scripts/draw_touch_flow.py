"""Drawing of docs/understand/touch-flow.md: the processes, the folders that a touch goes through, and the stop paths.

    python scripts/draw_touch_flow.py        writes docs/images/touch-flow.svg

The text of the drawing depends on this file alone; tests/test_docs.py compares it with the file that is committed.
"""

from pathlib import Path

TARGET = Path(__file__).parents[1] / "docs" / "images" / "touch-flow.svg"
WIDTH, HEIGHT = 1010, 690  # px
BYTES, STOP, OTHER = "#1f6fb2", "#c0392b", "#6b6b6b"  # colours of the arrows
STYLE = """
text { font-family: Helvetica, Arial, sans-serif; font-size: 13px; fill: #222; }
.title { font-size: 15px; font-weight: bold; }
.folder { font-family: Menlo, Consolas, monospace; font-weight: bold; }
.small { font-size: 11.5px; fill: #555; }
.file { font-family: Menlo, Consolas, monospace; font-size: 11px; fill: #555; }
.number { fill: #fff; font-weight: bold; font-size: 12px; text-anchor: middle; }
"""
Point = tuple[float, float]


def text(x: float, y: float, words: str, kind: str = "") -> str:
    """Return one line of text that begins at a point."""
    words = words.replace("&", "&amp;").replace("<", "&lt;")
    return f'<text x="{x:g}" y="{y:g}"' + (f' class="{kind}"' if kind else "") + f">{words}</text>"


def process(x: float, y: float, width: float, height: float, title: str, remark: str = "") -> list[str]:
    """Return the frame of a process with its title."""
    frame = f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="8" fill="#f4f6f8" stroke="#455a64"/>'
    return [frame, text(x + 12, y + 22, title, "title"), *([text(x + 12, y + 39, remark, "small")] if remark else [])]


def folder(x: float, y: float, width: float, name: str, *files: str) -> list[str]:
    """Return the box of a folder and the files in it that take part."""
    height = 24 + 15 * len(files)
    box = f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="4" fill="#fff" stroke="#90a4ae"/>'
    lines = [text(x + 9, y + 33 + 15 * row, file, "file") for row, file in enumerate(files)]
    return [box, text(x + 9, y + 17, name, "folder"), *lines]


def arrow(colour: str, *points: Point, dashed: bool = False) -> str:
    """Return an arrow through some points."""
    path = " L ".join(f"{x:g} {y:g}" for x, y in points)
    dash = ' stroke-dasharray="6 4"' if dashed else ""
    head = {BYTES: "bytes", STOP: "stop", OTHER: "other"}[colour]
    return f'<path d="M {path}" fill="none" stroke="{colour}" stroke-width="2"{dash} marker-end="url(#{head})"/>'


def number(x: float, y: float, value: int) -> list[str]:
    """Return the number of a step of the walk."""
    return [f'<circle cx="{x:g}" cy="{y:g}" r="10" fill="#263238"/>', text(x, y + 4, str(value), "number")]


def drawing() -> str:
    """Return the SVG."""
    lines = [
        *process(15, 30, 170, 120, "virtual skin", "or sensor and electronics"),
        *folder(27, 80, 146, "skin.virtual", "skin.py", "circuit.py"),
        *process(245, 30, 285, 452, "guard process", "one thread: robot/guard/loop.py"),
        *folder(260, 82, 255, "skin.sources", "serial_port.py"),
        *folder(260, 147, 255, "skin", "wire.py"),
        *folder(260, 212, 255, "skin.detection", "stream.py  reading.py  timing.py", "detector.py"),
        *folder(260, 292, 255, "robot.guard", "core.py  arm_supervisor.py", "phase.py"),
        *folder(260, 372, 255, "robot.stop", "arm_stop.py  stop_monitor.py"),
        *folder(260, 431, 255, "robot.reaction", "rules.py  retreat.py"),
        *process(670, 30, 185, 170, "driver process", "internal control"),
        *folder(682, 82, 161, "robot.driver", "messages.py"),
        *folder(682, 137, 161, "robot.ur", "driver_process.py", "ur_rtde.py"),
        *process(670, 350, 185, 130, "two guard watchdogs", "external control"),
        *folder(682, 402, 161, "robot.stop", "guard_watchdog.py", "backup_stop.py"),
        *process(245, 545, 610, 115, "your program"),
        *folder(260, 585, 160, "session", "session.py", "event_log.py"),
        *folder(440, 585, 160, "coneskin", "recording.py"),
        *folder(620, 585, 220, "session", "guard_monitor.py"),
        *process(905, 30, 95, 630, "controller"),
        text(917, 69, "of the arm,", "small"),
        text(917, 84, "or robot.sim", "small"),
        # the touch on its way down
        arrow(BYTES, (185, 101), (258, 101)),
        text(196, 94, "bytes", "small"),
        arrow(BYTES, (387, 121), (387, 145)),
        text(395, 138, "bytes", "small"),
        arrow(BYTES, (387, 186), (387, 210)),
        text(395, 203, "frames", "small"),
        arrow(BYTES, (387, 266), (387, 290)),
        text(395, 283, "touches, faults", "small"),
        arrow(OTHER, (387, 346), (387, 370)),
        arrow(OTHER, (387, 411), (387, 429)),
        # stops
        arrow(STOP, (530, 101), (680, 101)),
        text(538, 94, "stop path driver", "small"),
        arrow(STOP, (855, 150), (903, 150)),
        arrow(STOP, (530, 310), (903, 310)),
        text(538, 303, "program, command, protective: robot/ur/stop_sockets.py", "small"),
        arrow(STOP, (530, 440), (668, 440)),
        text(538, 433, "stop path watchdog", "small"),
        arrow(STOP, (855, 425), (903, 425)),
        # states, heartbeats, records
        arrow(OTHER, (905, 250), (532, 250)),
        text(538, 243, "states, 500 Hz: robot/ur/rtde_connection.py", "small"),
        arrow(OTHER, (530, 130), (668, 130), dashed=True),
        text(538, 146, "heartbeat", "small"),
        arrow(OTHER, (530, 465), (668, 465), dashed=True),
        text(538, 480, "heartbeat", "small"),
        arrow(OTHER, (340, 482), (340, 543)),
        text(348, 518, "blocks and events; any of them is a heartbeat", "small"),
        arrow(OTHER, (820, 545), (820, 520), (880, 520), (880, 180), (857, 180)),
        text(660, 514, "moves: session/arm_client.py", "small"),
        # the legend
        arrow(BYTES, (20, 560), (70, 560)),
        text(80, 564, "the touch", "small"),
        arrow(STOP, (20, 585), (70, 585)),
        text(80, 589, "stops", "small"),
        arrow(OTHER, (20, 610), (70, 610)),
        text(80, 614, "states, commands", "small"),
        arrow(OTHER, (20, 635), (70, 635), dashed=True),
        text(80, 639, "heartbeats", "small"),
    ]
    places = {1: (173, 42), 2: (500, 94), 3: (500, 159), 4: (500, 224), 5: (500, 244), 6: (500, 304), 7: (648, 101)}
    places |= {8: (827, 149), 9: (500, 384), 10: (500, 443), 11: (405, 597)}
    for value, (x, y) in places.items():
        lines += number(x, y, value)
    heads = [
        f'<marker id="{name}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto">'
        f'<path d="M 0 0 L 10 5 L 0 10 z" fill="{colour}"/></marker>'
        for name, colour in (("bytes", BYTES), ("stop", STOP), ("other", OTHER))
    ]
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    opening = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    title = "<title>Processes and folders that a touch goes through, and the stop paths</title>"
    ground = f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>'
    return "\n".join(
        [opening, title, f"<style>{STYLE}</style>", f"<defs>{''.join(heads)}</defs>", ground, *lines, "</svg>\n"]
    )


if __name__ == "__main__":
    TARGET.write_text(drawing(), encoding="utf-8")
