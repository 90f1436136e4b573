"""File of a picture: what may go wrong between a figure and the disk, said once for all pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import ConeSkinError, needed_package
from .files import explain_os_error

_PICTURE_SUFFIXES = (".png", ".svg", ".pdf")
#: of lines that no eye takes for each other (Okabe and Ito 2008)
_LINE_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00")
LINE_DASHES = ("-", "--", "-.", ":")  #: of curves in one plot, for paper without colour


@contextmanager
def picture_style() -> Iterator[None]:
    """Draw what is drawn inside in the one style of all pictures. matplotlib must be installed."""
    import matplotlib
    from cycler import cycler

    look = {"axes.spines.top": False, "axes.spines.right": False, "grid.alpha": 0.3, "axes.axisbelow": True}
    lines = {"axes.prop_cycle": cycler(color=_LINE_COLORS), "axes.titlesize": 10}
    words = {"text.parse_math": False, "text.usetex": False, "legend.fontsize": 8, "legend.frameon": False}
    with matplotlib.rc_context({**look, **lines, **words}):
        yield


def degree_ticks(axis: Any, span: float) -> None:
    """Set the ticks of an axis of matplotlib at every 15, 45 or 90 degrees, by its span [deg]."""
    from matplotlib.ticker import MultipleLocator

    axis.set_major_locator(MultipleLocator(90.0 if span > 200.0 else 45.0 if span > 60.0 else 15.0))


def write_picture(
    path: Path, what: str, compose: Callable[[Any], None], refusal: Callable[[str], ConeSkinError], dpi: int = 130
) -> None:
    """Draw a figure into a file, in the format of its suffix (png, svg, pdf).

    Args:
        path: of the file. That it can be written is looked at before anything is drawn.
        what: is drawn, such as "the picture of a run".
        compose: draws on the figure that it is given, and gives it a size.
        refusal: makes the error of a text.
        dpi: dots per inch of a png.

    Raises:
        MissingExtra: matplotlib is not installed.
        ConeSkinError: as ``refusal`` makes it: the suffix is another, the file cannot be written, or its content has
            no common scale.
    """
    if path.suffix.lower() not in _PICTURE_SUFFIXES:
        raise refusal(f"{what} is a {', '.join(_PICTURE_SUFFIXES)} file, got {path}")
    if not path.parent.is_dir():
        raise refusal(f"{what} cannot be written to {path}: there is no folder {path.parent}; make it first")
    with needed_package("matplotlib", "a picture", "pictures"):
        import matplotlib
        import numpy as np
        from matplotlib.figure import Figure
    matplotlib.use("Agg", force=False)
    # a name may have dollars in it; an overflow would be a warning, and a picture of nothing
    failure = explain_os_error(refusal, f"{what} cannot be written to {path}", "; name another file")
    with failure, picture_style(), np.errstate(over="raise"):
        try:
            figure = Figure(layout="constrained")
            compose(figure)
            figure.savefig(path, dpi=dpi)
        except ConeSkinError:
            raise
        except (ArithmeticError, ValueError) as exc:  # matplotlib's, for times or lengths of any size
            raise refusal(f"{what} cannot be drawn: its times or values have no common scale: {exc}") from exc
