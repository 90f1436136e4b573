"""Mutations of scene files: keys and values as a hurried hand, another program or an enemy may write them."""

import re
from random import Random

_VALUES = (
    "nan", "inf", "-inf", "-1", "0", "1e308", "1e-320", "9" * 5000, "0.1", "true", '"\\u0000"', '"\\u001b[2J"', "[]",
    "{}", "[[]]", "[{}]", "[nan, nan, nan]", "[1, 2]", "[[1, 2, 3, 4, 5, 6]]", "{a = {b = {}}}", '"' + "x" * 3000 + '"',
    "2026-01-01", "07:32:00", '"../../../../dev/zero"', '"/dev/zero"', '"stop"', '"retreat"', '"external"', '"virtual"',
    "'''", "0x", "[" * 2000, '"forearm"', '"UR20"', '"$a$"', '"%s{0}"',
)  # fmt: skip
_LINES = (
    "[arm]", "[[arm]]", "[link]", "[[link]]", "[[link.sensor]]", "[source]", "[[source.touch]]", "[reaction]",
    "[[reaction.rule]]", "[monitoring]", "[recording]", "[motion]", "[motion.waypoints_deg]", "arm = 5", "link = 5",
    "link = [5]", 'mesh = "."', 'file = "."', "sensor = 3", "touch = 1", "rule = {}", 'folder = ""',
    "a" + ".a" * 3000 + " = 1", '"" = 1', "= 1", "kind", "# only a remark", "[a.b.c]", "[[reaction]]", "name = 3",
)  # fmt: skip


def mutate(text: str, random: Random) -> bytes:
    """Return a scene with one to four mutations, as a file holds it."""
    lines = text.splitlines()
    for _ in range(random.choice((1, 1, 2, 4))):
        where = random.randrange(len(lines)) if lines else 0
        kind = random.randrange(5)
        if kind == 0 or not lines:
            lines.insert(where, random.choice(_LINES))
        elif kind == 1:
            del lines[where]
        elif kind == 2:
            other = random.randrange(len(lines))
            lines[where], lines[other] = lines[other], lines[where]
        else:
            places = [i for i, line in enumerate(lines) if re.match(r"\w+ = ", line)] or [where]
            where = random.choice(places)
            key = lines[where].partition("=")[0] or "key"
            lines[where] = f"{key}= {random.choice(_VALUES)}"
    raw = "\n".join(lines).encode()
    if random.random() < 0.1 and raw:
        at = random.randrange(len(raw))
        raw = raw[:at] + random.randbytes(3) + raw[at:]
    return raw
