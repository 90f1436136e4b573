"""``coneskin studio``: design the sheets for a link in a browser.

examples:
  coneskin studio forearm.stl -o skin            the link, its sheets, handles, layers; "write" makes the folder skin
  coneskin studio robot.urdf#forearm_link -o skin --tolerance-mm 0.5
  coneskin studio robot.urdf -o skins            all its links: choose one after another; a folder for each

The folder is the one that `coneskin design` writes. The page is served to this computer alone. Ctrl-C ends it.

Exit code: 0 shown; 1 the link cannot be read, or a package is not installed; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from .terminal import add_page_options, add_urdf_options, show_page, urdf_options

if TYPE_CHECKING:
    from coneskin.design.link_design import LinkMesh
    from coneskin.design.studio.workbench import Workbench


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("link", metavar="LINK", help="mesh file (STL, OBJ, DAE, PLY), FILE.urdf#LINK, or FILE.urdf")
    add("-o", "--output", type=Path, default=Path("skin"), metavar="DIR", help="to write (default skin)")
    add("--force", action="store_true", help="replace an earlier design in the folder")
    add("--tolerance-mm", type=float, default=1.0, metavar="MM", help="largest distance to the mesh (1)")
    add("--unit", choices=("m", "cm", "mm", "inch"), help="unit of the mesh (default: guessed)")
    add_urdf_options(add)
    add_page_options(parser, 8090)


def run(args: argparse.Namespace) -> int:
    """Show the studio."""
    from coneskin.design.link_design import load_link
    from coneskin.design.studio.studio_page import StudioPage
    from coneskin.design.studio.workbench import RobotLinks, Workbench
    from coneskin.view.page_server import PageServer

    def bench_of(link: LinkMesh) -> Workbench:
        return Workbench.of(link, tolerance=1e-3 * args.tolerance_mm)

    urdf = urdf_options(args)
    with PageServer("coneskin studio", port=args.port, uploads=True) as server:
        shown: Workbench | RobotLinks
        if args.link.lower().endswith((".urdf", ".xacro")):
            shown = RobotLinks(args.link, bench_of, **urdf)
        else:
            if not args.json:
                print(f"looking for sheets in {args.link} ...", file=sys.stderr, flush=True)
            shown = bench_of(next(iter(load_link(args.link, args.unit, **urdf))))
        page = StudioPage(server, shown, args.output, args.force, bench_of)
        show_page(args, server.url, "the studio is at {} (Ctrl-C ends it)").wait()
        del page
    return 0
