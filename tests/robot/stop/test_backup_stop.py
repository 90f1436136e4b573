"""Stops without a guard: not given up while the arm moves, quiet while a protective stop works; blind, they end."""

from itertools import pairwise

import pytest

from coneskin.core.channel import Channel, decode_json, pair
from coneskin.core.errors import RobotConnectionError
from coneskin.robot.driver.messages import LEAVE, Heartbeat
from coneskin.robot.driver.values import StopPath
from coneskin.robot.stop import arm_stop as module
from coneskin.robot.stop.backup_stop import StandstillHold
from coneskin.robot.stop.guard_watchdog import _GuardWatchdog
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.stop_monitor import StopMonitor
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.robot.ur.rtde_codec import STATE_RECIPE

Q = (0.0, -1.6, 1.6, -1.6, -1.6, 0.0)


class World:
    """Controller, ports and time in one: every look at the clock takes half a millisecond."""

    host = "nowhere"

    def __init__(self, speed=1.0, obeys=()):
        self.now, self.speed, self.obeys = 0.0, speed, obeys
        self.used = []
        self.safety = 1
        self.playing, self.talks, self.told = True, True, 0.0
        self.closed = self.opened = 0
        self.opening = 0.0  # s; that it takes to open what is missing
        self.reopened, self.timeouts = [], set()

    def clock(self):
        self.now += 0.0005
        return self.now

    # driver

    lost_with = UR_DRIVER.lost_with

    decode_state = staticmethod(UR_DRIVER.decode_state)

    def state_reader(self, host, timeout):
        self.now += self.opening
        self.timeouts.add(timeout)
        return self

    # stops

    def use(self, path, deceleration):
        self.used.append((self.now, path, deceleration))
        if path in self.obeys:
            self.speed = 0.0
        return True

    def reopen(self):
        self.reopened.append(self.now)
        self.now += self.opening
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
        return [STATE_RECIPE.pack([self.now, Q, qd, 7, self.safety, 2 if self.playing else 1, (0.0,) * 6, (0.0,) * 6])]

    def close(self):
        self.closed += 1

    def paths(self, since=0.0):
        return [path for time, path, _ in self.used if time >= since]


@pytest.fixture
def world():
    return World()


def holding(world):
    return StandstillHold(world, world, MonitoringLimits(), 10.0, world, clock=world.clock)


def stop(hold, deceleration=None, over=lambda: False):
    """Stop until the arm stands, or that is given up; return whether it stands."""
    hold.begin(deceleration)
    while hold.stopping and not over():
        hold.poll()
    return not (hold.stopping or hold.failed)


def test_the_first_stop_is_out_before_anything_else_and_one_is_enough(world):
    world.obeys = (StopPath.PROGRAM,)
    assert stop(holding(world)) is True
    assert [(path, a) for _, path, a in world.used] == [(StopPath.PROGRAM, 10.0)]
    assert stop(holding(world), 4.0) is True
    assert world.used[-1][2] == 4.0


@pytest.mark.pure
@pytest.mark.parametrize(("talks", "speed"), [(True, 1.0), (False, None)])
def test_a_speed_from_before_a_silence_is_not_that_of_the_stop(world, monkeypatch, talks, speed):
    made = []
    monkeypatch.setattr(module, "StopMonitor", lambda *given: made.append(given) or StopMonitor(*given))
    ours = holding(world)
    assert stop(ours, over=lambda: world.now > 1.0) is False  # it has seen the arm move
    world.talks, world.now = talks, world.now + 10.0
    stop(ours, over=lambda: True)
    assert made[-1][1] == speed


@pytest.mark.pure
@pytest.mark.parametrize(("held", "budget"), [(2.5, 0.5), (40.0, 0.2)])
def test_a_stop_has_the_time_that_the_motors_take(world, monkeypatch, held, budget):
    """1 rad/s at 2.5 rad/s2, or at the 10 that are commanded, and four times 25 ms."""
    made = []
    monkeypatch.setattr(module, "StopMonitor", lambda *given: made.append(given) or StopMonitor(*given))
    ours = StandstillHold(
        world,
        world,
        MonitoringLimits(),
        10.0,
        world,
        lambda q, qd: held if (q, qd[0]) == (Q, 1.0) else 0.1,
        world.clock,
    )
    world.clock()
    stop(ours, over=lambda: world.now > 0.1)
    world.now += 0.002
    stop(ours, over=lambda: True)
    assert made[-1][4] == pytest.approx(budget)


@pytest.mark.long
def test_while_the_arm_moves_it_is_not_given_up_and_a_protective_stop_is_left_to_work(world):
    end = 60.0
    assert stop(holding(world), over=lambda: world.now > end) is False
    assert world.now > end
    last = 0.0
    assert all(0.05 <= later - time < 0.06 for time, later in pairwise(world.reopened[1:])), "what is missing is opened"
    protective = [time for time, path, _ in world.used if path is StopPath.PROTECTIVE]
    assert len(protective) > 10
    for time in protective:  # nothing soon after it: the next program would replace it
        later = [other for other, *_ in world.used if other > time]
        assert not later or later[0] - time >= 4.0 * MonitoringLimits().escalate
        last = time
    assert last > end - 10.0


def test_a_stop_begun_soon_after_a_protective_one_does_not_replace_it(world):
    ours = holding(world)
    stop(ours, over=lambda: StopPath.PROTECTIVE in world.paths())
    count, at = len(world.used), world.now
    stop(ours, over=lambda: world.now > at + 0.05)
    assert len(world.used) == count


def test_without_a_state_it_ends_in_time(world):
    world.talks = False
    assert stop(holding(world)) is False
    assert 2.0 <= world.now < 3.0
    assert set(world.paths()) == {StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE}


# ---- stop_settings watch


def let_pass(world, hold, seconds):
    end, stops = world.now + seconds, 0
    while world.now < end:
        stops += hold.poll()
    return stops


def test_a_program_is_stopped_again_and_a_person_is_left_alone(world):
    world.obeys = (StopPath.PROGRAM,)
    hold = holding(world)
    assert hold.poll() is False  # the first stop; it may be a standstill between two starts
    assert hold.stands is False
    assert let_pass(world, hold, 1.0) == 1
    assert hold.stands is True
    assert let_pass(world, hold, 1.0) == 0
    world.speed = 0.02  # just above what counts as standing
    assert let_pass(world, hold, 0.3) == 0
    assert world.speed == 0.0
    assert hold.stands is False
    assert let_pass(world, hold, 1.0) == 1
    world.playing, world.speed = False, 0.5
    assert let_pass(world, hold, 1.0) == 0
    assert world.speed == 0.5


@pytest.mark.promise("P46")
def test_without_states_stops_are_repeated_and_with_them_it_sees_again(world):
    world.obeys = (StopPath.PROGRAM,)
    hold = holding(world)
    hold.begin()
    let_pass(world, hold, 1.0)
    assert hold.stands is True
    world.talks = False
    since = world.now
    let_pass(world, hold, 1.5)
    assert hold.failed is False
    let_pass(world, hold, 8.5)
    assert hold.stands is False
    assert hold.failed is True  # or a watchdog would stay for ever beside a controller that is gone
    times = [time for time, path, _ in world.used if time >= since and path is StopPath.PROGRAM]
    assert len(times) > 5
    assert all(1.0 <= later - time < 1.1 for time, later in pairwise(times[1:])), "one a second"
    assert world.timeouts == {0.5}
    assert StopPath.PROTECTIVE not in world.paths(since)  # nobody has seen it move
    world.talks, world.speed = True, 1.0
    let_pass(world, hold, 3.0)
    assert hold.stands is True
    assert hold.failed is False
    assert world.opened >= 1


def test_a_program_that_starts_again_gets_a_protective_stop_until_the_controller_shows_it(world):
    world.obeys = (StopPath.PROGRAM, StopPath.PROTECTIVE)
    hold = holding(world)
    hold.begin()
    assert StopPath.PROTECTIVE not in world.paths()
    world.speed = 1.0
    let_pass(world, hold, 0.3)
    assert world.paths().count(StopPath.PROTECTIVE) > 1
    assert hold.stands is False
    world.safety = 0b10000000100
    assert let_pass(world, hold, 0.01) == 1
    assert hold.stands is True


@pytest.mark.parametrize(("talks", "opening"), [(False, 0.0), (False, 0.45), (True, 0.0)])
def test_a_watchdog_that_is_left_alone_leaves_within_two_seconds_only_where_no_state_comes(world, talks, opening):
    world.talks, world.opening = talks, opening
    (guard, of_guard), (session, program) = (map(Channel, pair()) for _ in range(2))
    world.fileno = session.fileno
    hold = StandstillHold(world, world, MonitoringLimits(), 10.0, clock=world.clock)
    watchdog = _GuardWatchdog(guard, session, hold, second=True, clock=world.clock)
    of_guard.send(Heartbeat().encode())
    assert watchdog.poll(0.0)
    of_guard.close()
    left = world.now
    assert watchdog.poll(0.0)
    assert watchdog.poll(0.0)
    program.send(LEAVE)  # while something is opened
    while watchdog.poll(0.0) and world.now - left < 3.0:
        pass
    assert StopPath.PROGRAM in world.paths()
    if talks:  # and show that it moves
        assert world.now - left >= 3.0
    else:
        assert 1.0 < world.now - left < (1.9 if opening else 1.5)
        assert [decode_json(message) for message in program.receive()] == [{"stands": False}]
    for channel in (guard, of_guard, session, program):
        channel.close()


@pytest.fixture
def lonely(world):
    """A watchdog beside a world, its guard, and its program; and what takes time on with it."""

    def make(second):
        (guard, of_guard), (session, program) = (map(Channel, pair()) for _ in range(2))
        channels.extend((guard, of_guard, session, program))
        world.fileno = session.fileno
        reader = None if second else world
        hold = StandstillHold(world, world, MonitoringLimits(), 10.0, reader, clock=world.clock)
        return _GuardWatchdog(guard, session, hold, second=second, clock=world.clock), of_guard, program

    channels = []
    yield make
    for channel in channels:
        channel.close()


def goes_on(watchdog, world, until, beats=None):
    while world.now < until:
        if beats is not None:
            beats.send(Heartbeat().encode())
        if not watchdog.poll(0.0):
            return False
    return True


def test_patient_limits_keep_no_watchdog_for_longer(world):
    hold = StandstillHold(world, world, MonitoringLimits(arm_silence=1.0), 10.0, world, clock=world.clock)
    world.now = 1.0
    assert hold.rest()
    assert not hold.states_missing(1.1)
    world.now = 2.2
    assert hold.states_missing(1.1)


def test_a_pause_of_the_states_long_after_all_have_gone_lets_no_moving_arm_go(world, lonely):
    world.speed = 1.0
    watchdog, of_guard, program = lonely(second=False)
    of_guard.send(Heartbeat().encode())
    assert watchdog.poll(0.0)
    of_guard.close()
    program.send(LEAVE)
    assert goes_on(watchdog, world, world.now + 10.0)
    world.talks = False
    assert goes_on(watchdog, world, world.now + 1.5)


def test_the_second_watchdog_stops_the_arm_of_a_guard_that_ends_well_after_its_program(world, lonely):
    world.speed = 1.0
    watchdog, of_guard, program = lonely(second=True)
    assert goes_on(watchdog, world, world.now + 0.3, of_guard)
    program.send(LEAVE)
    assert goes_on(watchdog, world, world.now + 1.2, of_guard)
    of_guard.close()
    since = world.now
    assert goes_on(watchdog, world, world.now + 3.0)
    assert StopPath.PROGRAM in world.paths(since)


def test_with_neither_program_nor_states_nor_guard_a_watchdog_tries_for_600_ms(world, lonely):
    world.talks = False
    watchdog, of_guard, program = lonely(second=True)
    assert goes_on(watchdog, world, world.now + 0.3, of_guard)
    program.send(LEAVE)
    assert goes_on(watchdog, world, world.now + 1.2, of_guard)
    of_guard.close()
    gone = world.now
    assert goes_on(watchdog, world, gone + 0.58)
    assert not goes_on(watchdog, world, gone + 0.7)
    assert StopPath.PROGRAM in world.paths(gone)
