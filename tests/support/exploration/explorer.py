"""Explorer of a world: breadth first over abstract states, until there is no new one. It knows no guard.

A world can go back to where it was, has an abstract state (``key``), and takes actions by their names. After each
action it says which written invariants it has broken. What holds in the long run is read off the graph at the end: from
every state a helpful way leads to a state that is wanted.
"""

from __future__ import annotations

import random
import time
from collections import Counter, deque
from collections.abc import Container, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol


class World(Protocol):
    """What an explorer needs of a world."""

    def save(self) -> Any:
        """Return what ``restore`` needs to go on from here."""

    def restore(self, saved: Any) -> None:
        """Go back to where it was."""

    def key(self) -> Hashable:
        """Return the abstract state."""

    def actions(self) -> Sequence[str]:
        """Return what may happen next, the helpful actions included."""

    def helps(self, action: str) -> bool:
        """Tell whether a person who helps would do this."""

    def act(self, action: str) -> list[str]:
        """Let it happen, and return the invariants that are broken, one line each that begins with its name."""

    @property
    def wanted(self) -> bool:
        """True in a state to which every way has to lead back."""


@dataclass(frozen=True)
class Exploration:
    """What was found.

    Attributes:
        states: abstract states.
        steps: actions tried.
        depth: actions from the start to the farthest state.
        closed: True where no new state was left to go on from.
        seconds: that it took, of the processor.
        broken: invariant -> the shortest way on which it broke, and what was said.
        by_action: how often each action led to a new state.
        reached: the abstract states.
    """

    states: int
    steps: int
    depth: int
    closed: bool
    seconds: float
    broken: dict[str, tuple[tuple[str, ...], str]] = field(default_factory=dict)
    by_action: dict[str, int] = field(default_factory=dict)
    reached: frozenset[Hashable] = frozenset()


def explore(
    world: World,
    progress: str = "",
    most_states: int = 1_000_000,
    stop_at_first: bool = False,
    starts: Mapping[Hashable, Any] | None = None,
) -> Exploration:
    """Explore a world to the end.

    Args:
        world: in its first state; afterwards it is anywhere.
        progress: name of the invariant that a helpful way leads from every state to a wanted one. Empty for none.
        most_states: after which to give up.
        stop_at_first: end with the first broken invariant.
        starts: more states to go on from, as this world has saved them.
    """
    began = time.process_time()
    first = world.key()
    ways: dict[Hashable, tuple[Hashable | None, str, int]] = {first: (None, "", 0)}
    back: dict[Hashable, list[Hashable]] = {first: []}
    wanted = {first} if world.wanted else set()
    broken: dict[str, tuple[tuple[str, ...], str]] = {}
    queue: deque[tuple[Hashable, Any]] = deque([(first, world.save())])
    for key, saved in (starts or {}).items():
        ways[key], back[key] = (None, "", 0), []
        queue.append((key, saved))
    fresh: Counter[str] = Counter()
    steps = depth = 0
    while queue and len(ways) < most_states and not (stop_at_first and broken):
        here, saved = queue.popleft()
        world.restore(saved)
        for action in world.actions():
            steps += 1
            world.restore(saved)
            helps = world.helps(action)
            wrong = world.act(action)
            for line in wrong:
                broken.setdefault(line.partition(":")[0], ((*_way(ways, here), action), line))
            if wrong:
                continue
            key = world.key()
            if key not in ways:
                ways[key] = here, action, ways[here][2] + 1
                depth = max(depth, ways[key][2])
                back[key] = []
                fresh[action] += 1
                queue.append((key, world.save()))
                if world.wanted:
                    wanted.add(key)
            if helps:
                back[key].append(here)
    closed = not queue
    if progress and closed:
        reached, todo = set(wanted), list(wanted)
        while todo:
            for before in back[todo.pop()]:
                if before not in reached:
                    reached.add(before)
                    todo.append(before)
        stuck = [key for key in ways if key not in reached]
        if stuck:
            shortest = min(stuck, key=lambda key: ways[key][2])
            broken[progress] = (_way(ways, shortest), f"{progress}: {len(stuck)} states lead no way back")
    seconds = time.process_time() - began
    return Exploration(len(ways), steps, depth, closed, seconds, broken, dict(fresh), frozenset(ways))


_MOST_HELP = 200  # actions of a person who helps, chosen by chance, until one gives up


def wander(
    world: World, draw: random.Random, actions: int, progress: str, known: Container[Hashable] = ()
) -> tuple[list[str], list[tuple[Hashable, Any]], str]:
    """Let things happen by chance, one after the other from the start, and then a person help.

    Nothing is gone back to, and no state stands for others: what an explorer leaves out by its abstraction would show.

    Args:
        world: in its first state.
        draw: of the actions.
        actions: how many, at most.
        progress: name of the invariant that help leads to a wanted state.
        known: abstract states that need not be saved.

    Returns:
        the way, the abstract state after each action of it with what was saved there, and the first invariant that
        broke, empty where none did.
    """
    way: list[str] = []
    states: list[tuple[Hashable, Any]] = []
    while len(way) < actions + _MOST_HELP:
        helping = len(way) >= actions
        if helping and world.wanted:
            return way, states, ""
        way.append(draw.choice([each for each in world.actions() if not helping or world.helps(each)]))
        if wrong := world.act(way[-1]):
            return way, states, wrong[0]
        key = world.key()
        states.append((key, None if key in known else world.save()))
    return way, states, f"{progress}: no help leads back"


def _way(ways: dict[Hashable, tuple[Hashable | None, str, int]], key: Hashable) -> tuple[str, ...]:
    found: list[str] = []
    at: Hashable | None = key
    while at is not None and (step := ways[at])[0] is not None:
        found.append(step[1])
        at = step[0]
    return tuple(reversed(found))


def follow(world: World, way: Iterable[str]) -> list[str]:
    """Let a way happen, and return the invariants that break on it."""
    return [line for action in way for line in world.act(action)]
