"""Boards by the thousand, parts within their data sheets: ready, places, faults in an hour of warming up.

Of each board that is offered, and of some that are not: how many become ready, place three touches to 3 mm before and
after the hour, and report no fault; the worst place; the faults by name. With --causes also the mean of the worst place
in the third of the boards with the least, and in that with the most, of each cause.
The boards are drawn in tests/support/firmware/board_population.py from the limits in skin/firmware/parts.toml.
"""

from __future__ import annotations

import argparse
import math
import statistics
from collections import Counter

from bench.report import head, show
from tests.support.firmware.board_population import Verdict, judge

OFFERED = (
    *(("uno", "built-in"), ("nano-every", "built-in"), ("pico", "built-in"), ("teensy", "built-in")),
    *(("esp32", "ads1115"), ("uno", "ads1115"), ("uno", "ads1015"), ("uno", "ltc1867")),
)


def row(title: str, found: list[Verdict]) -> list[str]:
    """A row of the first table."""
    errors = [1e3 * each.error for each in found if math.isfinite(each.error)]
    names = Counter(name for each in found for name in each.faults)
    return [
        title,
        f"{100.0 * statistics.fmean(each.ready for each in found):.1f}",
        f"{100.0 * statistics.fmean(each.error <= 3e-3 for each in found):.1f}",
        f"{100.0 * statistics.fmean(not each.faults for each in found):.1f}",
        f"{max(errors, default=math.nan):.2f}",
        ", ".join(f"{name} {count}" for name, count in names.most_common(3)) or "none",
    ]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", type=int, default=1000, help="of each kind (default %(default)s)")
    parser.add_argument("--causes", action="store_true", help="tell the causes apart")
    args = parser.parse_args()
    print(head("numpy"))
    rows, causes = [], []
    for name, converter in OFFERED:
        found = [judge(name, converter, seed) for seed in range(args.boards)]
        title, third = name if converter == "built-in" else f"{name}, {converter}", max(1, args.boards // 3)
        rows.append(row(title, found))
        causes.append([title])
        for cause in found[0].cause:
            ordered = [1e3 * each.error for each in sorted(found, key=lambda each: abs(each.cause[cause]))]
            causes[-1].append(f"{statistics.fmean(ordered[:third]):.2f}..{statistics.fmean(ordered[-third:]):.2f}")
    few = max(1, args.boards // 10)
    for title, options in (
        ("the ESP32's own converter", {"esp32": True}),
        *(
            (f"pico, amplifier off by {1e3 * offset:+g} mV", {"offset": offset})
            for offset in (-5e-4, 5e-4, 1e-3, -1e-3)
        ),
    ):
        rows.append(row(title, [judge("pico", "built-in", seed, **options) for seed in range(few)]))
    columns = ["board", "ready %", "within 3 mm %", "no fault %", "worst mm", "faults"]
    show(f"{args.boards} boards of each kind; {few} of those that are not offered", columns, rows)
    if args.causes:
        show(
            "The worst place [mm], mean of the third of the boards with the least .. the most of a cause",
            ["board", *found[0].cause],
            causes,
        )


if __name__ == "__main__":
    main()
