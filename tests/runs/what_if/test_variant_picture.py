"""The picture of variants: a point for each, told apart where touches are missed."""

import math
import re
from pathlib import Path

import pytest

from coneskin.runs.what_if.variants import _shared_settings, _VariantScore, draw_variants, score_variants, variant_lines


def test_each_variant_is_a_point_with_its_name(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    scores = [
        _VariantScore("level=0.06", 9, 0, 1, 20, 0, 3, 0, 2.0, 4.0, 1.0),
        _VariantScore("level=$0.2$", 9, 0, 1, 20, 4, 0, 0, 8.0, 20.0, 1.0),
        _VariantScore("level=0.9", 9, 0, 1, 20, 20, 0, 0, math.nan, math.nan, 1.0),
        _VariantScore("level=-1", 0, 9, 0, 0, 0, 0, 0, math.nan, math.nan, 0.0),
    ]
    path = tmp_path / "delay.svg"
    from matplotlib import rc_context

    with rc_context({"svg.fonttype": "none"}):
        draw_variants(scores, path)
    text = re.sub(r"<[^>]+>", " ", path.read_text(encoding="utf-8"))
    for words in (
        "level=0.06: all 20",
        "level=$0.2$: 4 of 20 touches missed",
        "level=0.9: 20 of 20",
        "has no delay",
        "level=-1: no run could be judged",
        "in 1 h",
    ):
        assert words in text


def test_variants_at_one_point_do_not_lie_on_each_other(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import rc_context

    same = [_VariantScore(f"level={level}", 9, 0, 1, 20, 0, 3, 0, 2.0, 4.0, 1.0) for level in (0.06, 0.08)]
    with rc_context({"svg.fonttype": "none"}):
        draw_variants(same, tmp_path / "dot.svg")
        draw_variants([*same, same[0]._replace(false_alarms=9)], tmp_path / "delay.svg")
    assert "delay of the detection" not in (tmp_path / "dot.svg").read_text(encoding="utf-8"), "no panel of one dot"
    drawn = (tmp_path / "delay.svg").read_text(encoding="utf-8")
    assert ">1, 2<" in drawn  # one text at their point; the names stand below
    rows = [re.search(rf'y="([\d.]+)"[^>]*>{n}: level', drawn) for n in (1, 2)]
    assert None not in rows
    assert len({row[1] for row in rows if row}) == 2


def test_what_all_variants_share_is_said_once() -> None:
    names = ["a.b=1, c.d=2", "a.b=1, c.d=3", "a.b=1"]
    assert _shared_settings(names) == (["a.b=1"], ["c.d=2", "c.d=3", "without more"])
    assert _shared_settings(names[:1]) == ([], names[:1])
    assert _shared_settings([]) == ([], [])
    lines = variant_lines([_VariantScore(name, 9, 0, 1, 20, 0, 3, 0, 2.0, 4.0, 1.0) for name in names])
    assert lines[0] == "all with a.b=1"
    assert [line.split("  ")[0] for line in lines[2:]] == ["c.d=2", "c.d=3", "without more"]


def test_a_delay_is_against_the_truth_where_some_run_tells_it() -> None:
    fixed = {
        "variant": "a",
        "error": None,
        "same": True,
        "touches": 1,
        "missed": 0,
        "false_alarms": 0,
        "unlabeled": 0,
        "duration_s": 1.0,
    }
    recorded = {**fixed, "truth": "recorded", "delay_median_ms": 0.0, "delay_max_ms": 0.0}
    told = {**fixed, "truth": "virtual skin", "delay_median_ms": 5.0, "delay_max_ms": 6.0}
    (both,), (one,) = score_variants([recorded, recorded, told]), score_variants([recorded])
    assert (both.delay_median_ms, both.delay_max_ms, one.delay_median_ms) == pytest.approx((5.0, 6.0, 0.0))
    assert both.touches == 3
