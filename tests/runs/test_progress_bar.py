"""A bar for people: after a second, on a terminal, and nowhere else."""

import io

from coneskin.runs.progress_bar import ProgressBar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def drawn(stream: io.StringIO, *steps: tuple[float, float]) -> str:
    now = [0.0]
    bar = ProgressBar("9 runs", stream, lambda: now[0])
    for time, fraction in steps:
        now[0] = time
        bar(fraction)
    return stream.getvalue()


def test_it_is_quiet_for_a_second_and_off_a_terminal() -> None:
    assert drawn(Terminal(), (0.5, 0.5), (0.9, 1.0)) == ""
    assert drawn(io.StringIO(), (5.0, 0.5), (9.0, 1.0)) == ""


def test_it_tells_what_is_left_and_ends_with_a_line() -> None:
    out = drawn(Terminal(), (2.0, 0.25), (2.05, 0.26), (8.0, 1.0))
    assert "9 runs [########......................]  25%, 6 s left" in out
    assert out.count("\r") == 2  # one came too soon after the other
    assert out.endswith("100%, 0 s left  \n")
