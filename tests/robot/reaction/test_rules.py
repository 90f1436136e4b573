"""Which reaction a touch gets."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import RobotRefused
from coneskin.robot.reaction.rules import Rule, RuleSet
from coneskin.robot.reaction.types import KINDS, Reaction

levels = st.floats(0.0, 1.0)
speeds = st.floats(0.0, 5.0) | st.just(math.inf)
reactions = st.sampled_from([Reaction(kind=kind) for kind in KINDS])
rules = st.builds(
    Rule,
    reactions,
    st.none() | st.integers(0, 6),
    st.none() | levels,
    st.none() | st.floats(0.0, 5.0),
)
touches = st.lists(st.tuples(st.integers(0, 6), levels), max_size=5)


def fits_as_documented(rule, link, level, speed):
    """Written from docs/look-up/scene.md, not from the code: a list of what fails."""
    failed = []
    if rule.link is not None and link != rule.link:
        failed.append("link")
    if rule.level_above is not None and not level > rule.level_above:
        failed.append("level")
    if rule.speed_above is not None and not speed > rule.speed_above:
        failed.append("speed")
    return not failed


@given(st.lists(rules, max_size=6), reactions, st.integers(0, 6), levels, speeds)
def test_the_first_rule_that_fits_or_the_default(listed, default, link, level, speed):
    chosen = RuleSet(default, tuple(listed)).choose(link, level, speed)
    fitting = [rule.reaction for rule in listed if fits_as_documented(rule, link, level, speed)]
    assert chosen is (fitting[0] if fitting else default)


@pytest.mark.long
@given(st.lists(rules, max_size=6), reactions, touches, speeds)
def test_of_several_touches_the_hardest_counts(listed, default, touched, speed):
    every = RuleSet(default, tuple(listed))
    hardest = every.hardest(touched, speed)
    each = [every.choose(link, level, speed) for link, level in touched] or [default]
    assert KINDS.index(hardest.kind) == max(KINDS.index(one.kind) for one in each)
    assert hardest in each
    assert {one.kind for one in each} <= every.kinds | {default.kind}


@pytest.mark.promise("P03")
@given(st.lists(rules, max_size=6), reactions, touches, touches, speeds)
def test_another_touch_never_makes_it_gentler(listed, default, some, more, speed):
    every = RuleSet(default, tuple(listed))
    if some:
        alone, together = every.hardest(some, speed), every.hardest([*some, *more], speed)
        assert KINDS.index(together.kind) >= KINDS.index(alone.kind)


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        ({"link": -1}, "link must be 0 (base) or a link beyond it, got -1"),
        ({"level_above": -0.1}, "level_above must be finite and at least 0, got -0.1"),
        ({"speed_above": math.nan}, "speed_above must be finite and at least 0 rad/s, got nan"),
    ],
)
def test_conditions_that_cannot_be(condition, words):
    with pytest.raises(RobotRefused) as caught:
        Rule(Reaction(kind="retreat"), **condition)
    assert words in str(caught.value)


@given(st.lists(rules, max_size=6), reactions)
def test_without_motion_what_moves_becomes_a_stop_and_the_rest_stays(listed, default):
    rule_set = RuleSet(default, tuple(listed))
    still = rule_set.without_motion()
    assert not still.move
    assert [rule.fits(2, 0.5, 1.0) for rule in still.rules] == [rule.fits(2, 0.5, 1.0) for rule in listed]
    befores = [default, *(rule.reaction for rule in listed)]
    for before, after in zip(befores, [still.default, *(rule.reaction for rule in still.rules)], strict=True):
        moves = before.kind in ("retreat", "comply")
        assert after.kind == ("stop" if moves else before.kind)
        assert after.deceleration == before.deceleration
