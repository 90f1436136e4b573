"""Stops without a guard: not given up while the arm moves, quiet while a protective stop works; blind, they end."""

import pytest

from coneskin.errors import RobotConnectionError
from coneskin.robot import stopper as module
from coneskin.robot.state_reader import RECIPE
from coneskin.robot.stop_watch import Way
from coneskin.robot.stopper import Stopper
from coneskin.robot.vigil import Vigil
from coneskin.robot.watch import Watch

Q = (0.0, -1.6, 1.6, -1.6, -1.6, 0.0)


class World:
    """Controller, ports and time in one: every look at the clock takes half a millisecond."""

    host = "nowhere"

    def __init__(self, monkeypatch, speed=1.0, obeys=()):
        self.now, self.speed, self.obeys = 0.0, speed, obeys
        self.used = []
        self.playing, self.talks, self.told = True, True, 0.0
        self.closed = self.opened = 0
        monkeypatch.setattr(module.select, "select", lambda *_: ([], [], []))
        monkeypatch.setattr(module, "StateReader", lambda *_: self)

    def clock(self):
        self.now += 0.0005
        return self.now

    # stops

    def use(self, way, deceleration):
        self.used.append((self.now, way, deceleration))
        if way in self.obeys:
            self.speed = 0.0
        return True

    def reopen(self):
        return False

    def drain(self):
        return []

    # states

    def __enter__(self):
        if not self.talks:
            raise RobotConnectionError("refused")
        self.opened += 1
        return self

    def read(self):
        if not self.talks or self.now - self.told < 0.002:
            return []
        self.told = self.now
        qd = (self.speed, 0.0, 0.0, 0.0, 0.0, 0.0)
        return [RECIPE.pack([self.now, Q, qd, 7, 1, 2 if self.playing else 1])]

    def close(self):
        self.closed += 1

    def ways(self, since=0.0):
        return [way for time, way, _ in self.used if time >= since]


@pytest.fixture
def world(monkeypatch):
    return World(monkeypatch)


def stopper(world):
    return Stopper(world, Watch(), 10.0, world, world.clock)


def test_the_first_stop_is_out_before_anything_else_and_one_is_enough(world):
    world.obeys = (Way.SCRIPT,)
    assert stopper(world).stop() is True
    assert [(way, a) for _, way, a in world.used] == [(Way.SCRIPT, 10.0)]
    assert stopper(world).stop(4.0) is True
    assert world.used[-1][2] == 4.0


def test_while_the_arm_moves_it_is_not_given_up_and_a_protective_stop_is_left_to_work(world):
    end = 60.0
    assert stopper(world).stop(over=lambda: world.now > end) is False
    assert world.now > end
    last = 0.0
    protective = [time for time, way, _ in world.used if way is Way.PROTECTIVE]
    assert len(protective) > 10
    for time in protective:  # nothing soon after it: the next program would replace it
        later = [other for other, *_ in world.used if other > time]
        assert not later or later[0] - time >= 4.0 * Watch().escalate
        last = time
    assert last > end - 10.0


def test_a_stop_begun_soon_after_a_protective_one_does_not_replace_it(world):
    ours = stopper(world)
    ours.stop(over=lambda: Way.PROTECTIVE in world.ways())
    count, at = len(world.used), world.now
    ours.stop(over=lambda: world.now > at + 0.05)
    assert len(world.used) == count


def test_without_a_state_it_ends_in_time(world):
    world.talks = False
    assert stopper(world).stop() is False
    assert 2.0 <= world.now < 3.0
    assert set(world.ways()) == {Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE}


# ---- keeping watch


def let_pass(world, vigil, seconds):
    end, stops = world.now + seconds, 0
    while world.now < end:
        stops += vigil.look()
    return stops


def test_a_program_is_stopped_again_and_a_person_is_left_alone(world):
    world.obeys = (Way.SCRIPT,)
    vigil = Vigil(stopper(world), Watch().standstill, world.clock)
    assert vigil.look() is True  # the first stop
    assert vigil.stands is True
    assert let_pass(world, vigil, 1.0) == 0
    world.speed = 0.02  # just above what counts as standing
    assert let_pass(world, vigil, 0.1) == 1
    assert world.speed == 0.0
    world.playing, world.speed = False, 0.5
    assert let_pass(world, vigil, 1.0) == 0
    assert world.speed == 0.5


def test_without_states_stops_are_repeated_and_with_them_it_sees_again(world):
    world.obeys = (Way.SCRIPT,)
    vigil = Vigil(stopper(world), Watch().standstill, world.clock)
    vigil.begin()
    world.talks = False
    since = world.now
    let_pass(world, vigil, 10.0)
    assert vigil.stands is False
    assert 5 <= world.ways(since).count(Way.SCRIPT) <= 12  # about one a second
    assert Way.PROTECTIVE not in world.ways(since)  # nobody has seen it move
    world.talks, world.speed = True, 1.0
    let_pass(world, vigil, 3.0)
    assert vigil.stands is True
    assert world.opened >= 1
