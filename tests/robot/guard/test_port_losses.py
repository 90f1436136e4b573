"""Losses of ports: what is gone is said in any words, and stops the arm whatever they are."""

from hypothesis import example, given
from hypothesis import strategies as st

from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, decode_loss, encode_loss
from tests.support.guard_rig import GuardRig

HALF = "/dev/caf\udce9"  # a name in Latin-1, as Python reads it


@given(st.text(st.characters()))
@example(HALF)
def test_a_loss_is_said_in_any_words(why: str) -> None:
    assert decode_loss(encode_loss("skin", why)) == ("skin", why.encode("utf-8", "backslashreplace").decode())


def test_a_port_with_a_name_that_is_no_utf_8_is_a_loss_like_any() -> None:
    rig = GuardRig(speed=1.0).run(0.5)
    rig.mute_skin = True
    rig.feed(BlockKind.LOST, encode_loss("skin", f"{HALF} is gone"))
    assert rig.core.phase is Phase.STOPPING
    assert rig.event("stopping").details["why"] == r"/dev/caf\udce9 is gone"
