"""Runner of the benches, from the repository's root.

python -m bench                             list the benches
python -m bench NAME [options]              run one; --help has its options
python -m bench NAME [options] --save       ... and write bench/results/NAME.json
python -m bench NAME [options] --save=WHAT  ... or bench/results/NAME.WHAT.json, for a run with other options
python -m bench page                        make bench/RESULTS.md from these files
"""

from __future__ import annotations

import ast
import importlib
import io
import os
import sys
from contextlib import redirect_stdout
from pathlib import Path

from bench import report
from bench.table import BENCHES, Bench

ROOT = Path(__file__).parents[1]
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def about(module: str) -> str:
    """Return the first line of a module's docstring, without importing it."""
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    return (ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or "").partition("\n")[0]


class _Tee(io.StringIO):
    """Standard output that also keeps what is written."""

    def write(self, text: str) -> int:
        sys.__stdout__.write(text)  # type: ignore[union-attr]
        sys.__stdout__.flush()  # type: ignore[union-attr]
        return super().write(text)


def main() -> int:
    name, *rest = sys.argv[1:] or ["--help"]
    if name in ("-h", "--help"):
        print(__doc__)
        for known, bench in BENCHES.items():
            print(f"{known:20s} {about(bench.module)}")
        return 0
    if name not in BENCHES and name != "page":
        print(f"There is no bench {name!r}. Choose one of: {', '.join(BENCHES)}, page", file=sys.stderr)
        return 2
    bench = BENCHES.get(name, Bench("bench.page", ""))
    # children of a bench find the package too, wherever they run
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    if bench.one_thread:  # the libraries read these once, on loading
        os.environ.update(dict.fromkeys(_THREADS, "1"))
    saves = [word for word in rest if word.partition("=")[0] == "--save"]
    options = [word for word in rest if word not in saves]
    sys.argv = [f"python -m bench {name}", *options]
    run = importlib.import_module(bench.module).main
    if not saves:
        return int(run() or 0)
    printed = _Tee()
    with redirect_stdout(printed):
        code = int(run() or 0)
    file = report.save(name, options, bench.not_shown, printed.getvalue(), saves[-1].partition("=")[2])
    print(f"saved to {file.relative_to(ROOT)}")
    return code


if __name__ == "__main__":
    sys.exit(main())
