"""``coneskin guard``: what it says of a scene, its last words, and its exit code."""

import json
import signal
import sys

import pytest

from coneskin.cli import main
from coneskin.core.errors import Collision, RobotConnectionError
from coneskin.robot.guard.signals.journal import SLIDER_HOLDS, GuardEvent
from coneskin.scene.reader import parse_scene
from coneskin.session.outcome import exit_code, stands
from coneskin.session.session import _defer_interrupts

from ..scene.scenes import SERIAL_RETREAT, SKIN_ONLY

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
    code = main(["doctor", str(tmp_path / "scene.toml"), "--check", *words])
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
    assert [
        line.split("cannot be guarded yet: a guard needs a ")[1].split()[-1] for line in err.splitlines()
    ] == missing
    assert "scene.toml" in out  # what there is, is listed all the same
    code, out, _ = check(tmp_path, text, capsys, "--json")
    assert code == 1
    assert len(json.loads(out)["cannot_be_guarded_yet"]) == len(missing)


def test_an_arm_that_will_only_stop_is_the_last_thing_that_is_said(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("coneskin.scene.required_packages.find_spec", lambda name: name)  # not of every Python
    code, out, err = check(tmp_path, SERIAL_RETREAT, capsys)
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == (
        "the arm will only stop when it is touched; to let it move away: coneskin commission scene.toml"
    )
    _, out, _ = check(tmp_path, SERIAL_RETREAT.replace("retreat", "stop"), capsys)
    assert "only stop" not in out


def test_rules_distances_and_limits_are_listed(tmp_path, capsys):
    code, out, _ = check(tmp_path, SERIAL_RETREAT + RULE, capsys)
    assert code == 0
    lines = {line.split("  ")[0].strip(): line for line in out.splitlines()}
    assert "then at most 60 mm at up to 150 mm/s within 2 s" in lines["reaction"]
    assert "no point of the arm farther than 100 mm or faster than 250 mm/s" in lines["reaction"]
    assert lines["reaction"].endswith("TOWARDS WHAT NO SKIN COVERS at up to 8 mm/s")
    first, second = (line for line in out.splitlines() if line.startswith("rule "))
    assert first.endswith("where touched on the forearm and level above 0.5")
    assert "slow to 30 %" in second
    assert "no more than 0.5 mm into the touch" in second
    assert second.endswith("where arm faster than 0.8 rad/s")
    assert "program silent for 150 ms: stop" in lines["monitoring"]
    assert "next stop path after 25 ms without slowdown; standing below 0.01 rad/s" in lines["monitoring"]


@pytest.mark.parametrize(
    ("electronics", "said"),
    [
        (
            "",
            "certain after about 2 frames of a firm touch: then a second contact of about 2 N (0.7 millisiemens), "
            "20 deg off",
        ),
        ("adc_bits = 16", "certain after about 1 frame of"),
        ("adc_bits = 9\ncurrent_full_scale_ma = 20", "this sensor's place never becomes certain: the arm only stops"),
    ],
)
def test_when_the_place_of_a_touch_is_certain_is_listed(tmp_path, capsys, electronics, said):
    text = SERIAL_RETREAT.replace("[[link.sensor]]", f"[[link.sensor]]\n{electronics}")
    code, out, _ = check(tmp_path, text, capsys)
    assert code == 0
    assert said in next(line for line in out.splitlines() if line.startswith("place on upper arm skin"))


def test_a_binary_file_is_said_to_be_no_toml_text(tmp_path, capsys):
    (tmp_path / "photo.toml").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    assert main(["doctor", str(tmp_path / "photo.toml"), "--check"]) == 1
    assert "this is not a TOML text" in capsys.readouterr().err


# ---- what is known at the end


def events(*names):
    """Events by name; "stopping: why" and "fallback_stop: yes" or "fallback_stop: no" say more."""
    reported = []
    for name in names:
        word, _, more = name.partition(": ")
        details = {
            "stopping": {"why": more},
            "ending": {"what": "told to end"},
            "fallback_stop": {"stands": more == "yes"},
            "latched": {"why": more},
        }
        reported.append(GuardEvent(word, 1.0, details.get(word, {"what": "?"})))
    return reported


@pytest.mark.parametrize(
    ("names", "code", "standing"),
    [
        (["activated"], 0, False),
        (["activated", "stopping: told to end", "ending", "standstill", "latched"], 0, True),
        (["activated", "stopping: told to end", "ending"], 0, False),
        (["activated", "stopping: touch", "contact"], 3, False),
        (["activated", "stopping: touch", "standstill", "latched", "reset", "activated"], 3, False),
        (["activated", "stopping: the skin is silent", "standstill", "latched"], 1, True),
        (["activated", "stopping: touch", "standstill", "retreating"], 3, False),
        (["activated", "guard_unresponsive", "fallback_stop: yes"], 1, True),
        (["activated", "latched", "guard_exited", "fallback_stop: no"], 1, False),
    ],
)
def test_the_exit_code_and_the_last_words_are_what_is_known(names, code, standing):
    assert exit_code(events(*names), arm=True) == code
    assert stands(events(*names)) is standing


@pytest.mark.parametrize(
    ("names", "code"),
    [(["activated"], 0), (["activated", "fault"], 1), (["activated", "contact"], 3), (["fault", "contact"], 3)],
)
def test_without_an_arm_a_touch_and_a_fault_have_their_exit_codes_too(names, code):
    assert exit_code(events(*names), arm=False) == code
    assert exit_code(events(*names), arm=True) == 0  # there the stop counts


class FakeSession:
    """Stand-in for a guarded run, with prescribed events and checks."""

    recording = None
    latched_stop = 1

    def __init__(self, scene, reported, at_close, check, gone=()):
        self.gone = list(gone)  # for each look at the guard: what is raised, or None
        self.scene, self.events, self._at_close, self._check = scene, reported, at_close, check

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

    def run(reported, at_close, check, gone=(), text=SERIAL_RETREAT, words=()):
        (tmp_path / "scene.toml").write_text(text)
        session = FakeSession(parse_scene(text), events(*reported), events(*at_close), check, gone)
        monkeypatch.setattr("coneskin.session.session.guard", lambda *_, **__: session)
        return main(["guard", str(tmp_path / "scene.toml"), *words]), capsys.readouterr().err

    yield run
    signal.signal(signal.SIGTERM, handler)


def interrupt(session):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("reported", "at_close", "code", "said"),
    [
        (["activated"], ["stopping: told to end", "ending", "latched"], 0, "ended by you; the arm stands\n"),
        (
            ["activated"],
            ["stopping: told to end", "ending"],
            0,
            "ended by you; standstill of the arm NOT confirmed: look at the arm",
        ),
        (["activated", "stopping: touch"], ["ending", "latched"], 3, "ended by you; the arm stands\n"),
        (["activated", "guard_unresponsive"], [], 1, "standstill of the arm NOT confirmed"),
        ([], [], 0, "ended by you; the guard was not active yet"),
    ],
)
def test_ctrl_c_keeps_the_exit_code_and_says_what_is_known(command, reported, at_close, code, said):
    ended, words = command(reported, at_close, interrupt)
    assert ended == code
    assert said in words


@pytest.mark.parametrize(("name", "code"), [("contact", 3), ("fault", 1)])
def test_without_an_arm_once_ends_at_the_first_touch_or_fault(command, name, code):
    looks = []

    def look(session):
        looks.append(name)
        session.events += events(name)
        assert len(looks) < 3, "it goes on"

    assert command(["activated"], [], look, text=SKIN_ONLY, words=["--once"])[0] == code
    assert looks == [name]


def collide(session):
    raise Collision("the cuff was touched")


def test_an_arm_that_only_the_slider_holds_under_a_program_is_said_to_be_held_so(command):
    """Who raises the slider after the guard has ended would move the arm."""
    held = f"latched: the stop path is lost; {SLIDER_HOLDS}"
    _, words = command(["activated", "stopping: the stop path is lost", held], [], interrupt)
    assert words.endswith(f"the arm stands; {SLIDER_HOLDS}\n")
    assert "the speed slider at 0" in words
    assert "end the program before" in words
    _, words = command(
        ["activated", "stopping: x", held, "reset", "activated", "stopping: y", "latched: y"], [], interrupt
    )
    assert SLIDER_HOLDS not in words


HANGS = RobotConnectionError("the guard hangs")


@pytest.mark.long
def test_a_guard_that_is_gone_is_noticed_while_it_waits_for_a_reset(command):
    code, said = command(["activated", "stopping: touch"], [], collide, gone=[None, HANGS, HANGS])
    assert code == 1
    assert 'type "reset"' in said
    assert said.endswith("coneskin guard: the guard hangs\n")


@pytest.mark.promise("P47")
def test_beside_an_externally_controlled_arm_it_stays_until_the_guard_lives_again(command):
    """A program that ended with its guard would leave a moving arm unguarded."""
    checks = iter([HANGS, KeyboardInterrupt()])

    def check(session):
        raise next(checks)

    external = SERIAL_RETREAT.replace("[arm]", '[arm]\ncontrol = "external"')
    code, said = command(
        ["activated", "guard_unresponsive", "fallback_stop: yes"], [], check, gone=[HANGS, HANGS, None], text=external
    )
    assert code == 1
    assert "the guard hangs\nthe arm is held at standstill from here until the guard lives again" in said
    assert said.endswith("ended by you; the arm stands\n")


# ---- a second Ctrl-C


@pytest.fixture
def interrupts():
    """Ctrl-C as a terminal has it: a program that runs in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.promise("P47")
@pytest.mark.usefixtures("interrupts")
def test_a_job_is_done_although_a_person_interrupts_it_twice():
    done = []

    def job():
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
        done.append(True)

    with pytest.raises(KeyboardInterrupt):
        _defer_interrupts(job)
    assert done == [True]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)  # as before


def test_what_a_job_raises_is_raised():
    def job():
        raise RobotConnectionError("gone")

    with pytest.raises(RobotConnectionError, match="gone"):
        _defer_interrupts(job)


@pytest.mark.parametrize(("words", "bound"), [(["--duration-s", "3"], 3.0), (["--duration-s", "60"], 20.0), ([], 20.0)])
def test_the_wait_for_a_skin_is_bounded_by_the_duration(tmp_path, monkeypatch, words, bound):
    asked = []

    def refused(scene, **options):
        asked.append(options["start_timeout"])
        raise RobotConnectionError("no more is looked at")

    monkeypatch.setattr("coneskin.session.session.guard", refused)
    (tmp_path / "scene.toml").write_text(SKIN_ONLY)
    assert main(["guard", str(tmp_path / "scene.toml"), *words]) == 1
    assert asked == [bound]
