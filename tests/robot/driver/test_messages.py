"""Commands of the guard to the driver process, as bytes."""

from hypothesis import example, given
from hypothesis import strategies as st

from coneskin.robot.driver.messages import (
    DatedVelocity,
    EndReaction,
    Heartbeat,
    Release,
    SetJointVelocity,
    Shutdown,
    StatusReport,
    StopProgram,
    decode_command,
)

finite = st.floats(allow_nan=False)


@given(
    st.one_of(
        st.builds(StopProgram, finite),
        st.builds(EndReaction, finite),
        st.builds(Release, st.integers(0, 2**64 - 1)),
        st.sampled_from([Heartbeat(), Shutdown()]),
        velocities := st.builds(SetJointVelocity, st.tuples(*[finite] * 6), finite),
        st.builds(DatedVelocity, finite, velocities),
    )
)
def test_commands_survive_the_wire(command):
    back = decode_command(command.encode())
    assert back == command
    assert type(back) is type(command)


@given(st.binary(max_size=80))
def test_nonsense_is_refused(message):
    try:
        command = decode_command(message)
    except ValueError:
        return
    assert command.encode() == message or message[:1] in b"DVSHC"


@given(st.text(st.characters()))
@example("/dev/caf\udce9")
def test_a_report_with_any_text_arrives(text):
    """The name of a file that is no UTF-8 must not end the process that reports it."""
    back = StatusReport.decode(StatusReport("error", text).encode())
    assert back == StatusReport("error", text.encode("utf-8", "backslashreplace").decode())
