"""Runner of the benches, from the repository's root: `python -m bench` lists them, `python -m bench NAME` runs one."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import os
import sys
from pathlib import Path

from bench.table import BENCHES

ROOT = Path(__file__).parents[1]
#: benches that compare run times of numerical libraries, which are held to one thread
ONE_THREAD = {"decode", "field", "field-extremes", "skins"}


def about(module: str) -> str:
    """Return the first line of a module's docstring, without importing it."""
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    return (ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or "").partition("\n")[0]


def main() -> int:
    name, *rest = sys.argv[1:] or [""]
    if name not in BENCHES:
        if name.lstrip("-") not in ("", "h", "help"):
            print(f"There is no bench {name!r}. Choose one of:\n", file=sys.stderr)
        for known, module in BENCHES.items():
            print(f"{known:20s} {about(module)}")
        return int(name.lstrip("-") not in ("", "h", "help"))
    # children of a bench find the package too, wherever they run
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    if name in ONE_THREAD:  # the libraries read these once, on loading
        os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    sys.argv = [f"python -m bench {name}", *rest]
    return importlib.import_module(BENCHES[name]).main() or 0


if __name__ == "__main__":
    sys.exit(main())
