"""``coneskin guard``: what it says of a scene, its last words, and its exit code."""

import json
import signal
import sys

import pytest

from coneskin.cli import main
from coneskin.errors import Collision, RobotConnectionError
from coneskin.robot.journal import GuardEvent
from coneskin.scene_reader import parse_scene
from coneskin.uninterrupted import uninterrupted
from coneskin.verdict import exit_code, stands

from .scenes import SERIAL_RETREAT, SKIN_ONLY

RULE = """
[[reaction.rule]]
link = "forearm"
level_above = 0.5
kind = "stop"
[[reaction.rule]]
speed_above_rad_s = 0.8
kind = "slow"
slow_to = 0.3
"""


def check(tmp_path, text, capsys, *words):
    (tmp_path / "scene.toml").write_text(text)
    code = main(["guard", str(tmp_path / "scene.toml"), "--check", *words])
    return code, *capsys.readouterr()


# ---- --check


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("", ["[source]", "[[link.sensor]]"]),
        ("# only a comment\n", ["[source]", "[[link.sensor]]"]),
        (SKIN_ONLY[: SKIN_ONLY.index("[source]")], ["[source]"]),
    ],
)
def test_a_scene_that_the_guard_would_refuse_is_said_to_be_one(tmp_path, capsys, text, missing):
    code, out, err = check(tmp_path, text, capsys)
    assert code == 1
    assert [line.split("cannot guard yet: a guard needs a ")[1].split()[-1] for line in err.splitlines()] == missing
    assert "scene.toml" in out  # what there is, is listed all the same
    code, out, _ = check(tmp_path, text, capsys, "--json")
    assert code == 1
    assert len(json.loads(out)["cannot_guard_yet"]) == len(missing)


def test_rules_distances_and_limits_are_listed(tmp_path, capsys):
    code, out, _ = check(tmp_path, SERIAL_RETREAT + RULE, capsys)
    assert code == 0
    lines = {line.split("  ")[0].strip(): line for line in out.splitlines()}
    assert "then at most 60 mm at up to 150 mm/s within 2 s" in lines["reaction"]
    assert "no point of the arm faster than 500 mm/s" in lines["reaction"]
    first, second = (line for line in out.splitlines() if line.startswith("rule "))
    assert first.endswith("where touched on the forearm and level above 0.5")
    assert "slow to 30 %" in second
    assert second.endswith("where arm faster than 0.8 rad/s")
    assert "next way to stop after 25 ms without slowdown; standing below 0.01 rad/s" in lines["watch"]


def test_a_binary_file_is_said_to_be_no_toml_text(tmp_path, capsys):
    (tmp_path / "photo.toml").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    assert main(["guard", str(tmp_path / "photo.toml"), "--check"]) == 1
    assert "this is not a TOML text" in capsys.readouterr().err


# ---- what is known at the end


def events(*names):
    """Events by name; "stopping: why" and "kept: yes" or "kept: no" say more."""
    told = []
    for name in names:
        word, _, more = name.partition(": ")
        details = {"stopping": {"why": more}, "ending": {"what": "told to end"}, "kept": {"stands": more == "yes"}}
        told.append(GuardEvent(word, 1.0, details.get(word, {"what": "?"})))
    return told


@pytest.mark.parametrize(
    ("names", "code", "standing"),
    [
        (["armed"], 0, False),
        (["armed", "stopping: told to end", "ending", "standstill", "latched"], 0, True),
        (["armed", "stopping: told to end", "ending"], 0, False),
        (["armed", "stopping: touch", "contact"], 3, False),
        (["armed", "stopping: touch", "standstill", "latched", "reset", "armed"], 3, False),
        (["armed", "stopping: the skin is silent", "standstill", "latched"], 1, True),
        (["armed", "stopping: touch", "standstill", "retreating"], 3, False),
        (["armed", "hung", "kept: yes"], 1, True),
        (["armed", "latched", "died", "kept: no"], 1, False),
    ],
)
def test_the_exit_code_and_the_last_words_are_what_is_known(names, code, standing):
    assert exit_code(events(*names)) == code
    assert stands(events(*names)) is standing


class FakeSession:
    """Does what ``check`` and the events are told to; stands in for a guarded run."""

    recording = None

    def __init__(self, scene, told, at_close, check, gone=()):
        self.gone = list(gone)  # for each look at the guard: what is raised, or None
        self.scene, self.events, self._at_close, self._check = scene, told, at_close, check

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.events += self._at_close

    def check(self):
        self._check(self)

    def check_guard(self):
        if self.gone and (error := self.gone.pop(0)):
            raise error


@pytest.fixture
def command(tmp_path, monkeypatch, capsys):
    """Run ``coneskin guard`` on a session of our own; its exit code and what it says."""
    monkeypatch.setattr(sys, "stdin", [])
    handler = signal.getsignal(signal.SIGTERM)

    def run(told, at_close, check, gone=(), text=SERIAL_RETREAT):
        (tmp_path / "scene.toml").write_text(text)
        session = FakeSession(parse_scene(text), events(*told), events(*at_close), check, gone)
        monkeypatch.setattr("coneskin.session.guard", lambda *_, **__: session)
        return main(["guard", str(tmp_path / "scene.toml")]), capsys.readouterr().err

    yield run
    signal.signal(signal.SIGTERM, handler)


def interrupt(session):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("told", "at_close", "code", "said"),
    [
        (["armed"], ["stopping: told to end", "ending", "latched"], 0, "ended by you; the arm stands\n"),
        (["armed"], ["stopping: told to end", "ending"], 0, "ended by you; the arm was NOT seen to stand: look at it"),
        (["armed", "stopping: touch"], ["ending", "latched"], 3, "ended by you; the arm stands\n"),
        (["armed", "hung"], [], 1, "the arm was NOT seen to stand"),
        ([], [], 0, "ended by you; it had not armed"),
    ],
)
def test_ctrl_c_keeps_the_exit_code_and_says_what_is_known(command, told, at_close, code, said):
    ended, words = command(told, at_close, interrupt)
    assert ended == code
    assert said in words


def collide(session):
    raise Collision("the cuff was touched")


HANGS = RobotConnectionError("the guard hangs")


def test_a_guard_that_is_gone_is_noticed_while_it_waits_for_a_reset(command):
    code, said = command(["armed", "stopping: touch"], [], collide, gone=[None, HANGS, HANGS])
    assert code == 1
    assert 'type "reset"' in said
    assert said.endswith("coneskin guard: the guard hangs\n")


def test_beside_a_foreign_arm_it_stays_until_the_guard_lives_again(command):
    """Whoever ends with its guard would leave an arm that moves to nobody."""
    checks = iter([HANGS, KeyboardInterrupt()])

    def check(session):
        raise next(checks)

    foreign = SERIAL_RETREAT.replace("[arm]", '[arm]\ncontrol = "foreign"')
    code, said = command(["armed", "hung", "kept: yes"], [], check, gone=[HANGS, HANGS, None], text=foreign)
    assert code == 1
    assert "the guard hangs\nthe arm is kept standing from here until the guard lives again" in said
    assert said.endswith("ended by you; the arm stands\n")


# ---- a second Ctrl-C


def test_a_job_is_done_although_a_person_interrupts_it_twice():
    done = []

    def job():
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
        done.append(True)

    with pytest.raises(KeyboardInterrupt):
        uninterrupted(job)
    assert done == [True]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)  # as before


def test_what_a_job_raises_is_raised():
    def job():
        raise RobotConnectionError("gone")

    with pytest.raises(RobotConnectionError, match="gone"):
        uninterrupted(job)
