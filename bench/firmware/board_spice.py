"""What a board's converter sees, by ngspice on the board's netlist, beside the virtual circuit.

Three sensors, each with a touch of 3 mS in the middle and one of .4 mS near a corner, and two boards. The deck comes
from the components that the drawing comes from: cable of 3 m, capacitance between the layers, switches, clamps,
amplifier with its bandwidth, filters. It runs two frames in the firmware's order and dwell, and then each phase for so
long that all has settled. First column: the largest difference of the settled deck and the virtual circuit, of full
scale. Second: what is not settled yet where the firmware reads first. Third: what clamps and switches that are warm
add to an untouched guide. Fourth: what 1 V of mains on 30 pF to the upper sheet leaves on a guide that is touched.
Needs ngspice.
"""

from __future__ import annotations

import argparse
import shutil
import sys

from bench.report import head, show
from coneskin.skin.firmware.board_circuit import board_circuit
from tests.support.firmware.spice_deck import BOARDS, SENSORS, compare, scenes


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--detail", action="store_true", help="say of each reading how far it is off")
    args = parser.parse_args()
    if shutil.which("ngspice") is None:
        sys.exit("ngspice is not there: apt-get install ngspice")
    rows = []
    for title, bare in SENSORS.items():
        for name, converter in BOARDS:
            circuit = board_circuit(name, bare, converter)
            both = [compare(circuit, contacts) for contacts in scenes(bare).values()]
            worst = [max(found[key] for found in both) for key in ("agreement", "unsettled", "warm", "mains")]
            rows.append([title, name, *(f"{value:.1e}" for value in worst)])
            if args.detail:
                print(title, name, [{k: f"{v:.1e}" for k, v in found.items() if k[:3] == "off"} for found in both])
    print(head())
    show(
        "ngspice beside the virtual circuit: of full scale",
        ["sensor", "board", "differs", "unsettled", "warm", "mains"],
        rows,
    )


if __name__ == "__main__":
    main()
