"""Running URScript programs of the simulated controller: their threads take turns in each control cycle.

In a cycle the main thread goes first, then the others in the order in which they were started; each runs until it
blocks, or has used its time slice: then it goes on in the next cycle. Only one thread may move the arm in a cycle: as
on the real controller, a second one ends the program. ``sec`` programs run beside the main one.

Source: Universal Robots, "The URScript Programming Language", page "Thread scheduling".
"""

from __future__ import annotations

import marshal
import time
from collections.abc import Callable, Generator, Iterator
from inspect import isgenerator
from typing import Any

from coneskin.robot.sim.urscript.translator import Interpreter, Translation
from coneskin.robot.sim.urscript.values import OPERATIONS, ScriptError, call_method

from .builtins import Builtins
from .io_functions import AbsentHandle
from .script_host import CallingProgram, ScriptHost
from .socket_functions import RemoteHandle

_MAX_STEPS = 200  # turns of loops, and calls, of a thread in one cycle: its time slice
_MAX_TURN_TIME = 0.001  # s of the processor that all threads of a program may use in one cycle: half of it
_MAX_THREADS = 100  # of a program, with those that have ended in this cycle


class Thread:
    """Thread of a program: a generator that yields where it waits for the next cycle."""

    __slots__ = ("alive", "body", "name")

    def __init__(self, name: str, body: Iterator[object]) -> None:
        self.name, self.body, self.alive = name, body, True


class _Halted(Exception):
    """Statement ``halt`` of a program."""


class Program(CallingProgram):
    """Program with its compiled text and the state of its threads.

    Attributes:
        secondary: True for a ``sec`` program, which runs beside the main one and must not move the arm.
        driver: thread that moves the arm, or None.
        driven: cycle in which that thread last did; -1 before the first time.
        current: thread that runs now.
        interpreter: of the statements that come while it runs.
    """

    def __init__(self, host: ScriptHost, translation: Translation) -> None:
        super().__init__(translation.name)
        self._host, self.secondary = host, translation.secondary
        self.driver: Thread | None = None
        self.driven = -1
        self.current: Thread
        self._steps = 0
        self._end_time = 0.0
        own = {name: getattr(self, name) for name in ("_halt", "_pause", "_join", "_kill", "_run", "_spent", "_method")}
        space: dict[str, Any] = {**OPERATIONS, "_absent": object(), **own}
        builtins = Builtins(host, self)
        space |= {f"b_{name}": getattr(builtins, name) for name in Builtins.functions()}
        exec(marshal.loads(translation.code), space)  # the text was parsed, and nothing but its own names is in it
        self._translation = translation
        self._main = Thread("main", space["main"]())
        self.threads = [self._main]
        self.interpreter = Interpreter(space, translation.names, Builtins.functions())

    @property
    def running(self) -> bool:
        """True until the main thread has come to its end."""
        return self._main.alive

    def close(self) -> None:
        """Close the connections that it has opened."""
        for connection in self.sockets.values():
            connection.close()
        self.sockets.clear()

    def turn(self) -> None:
        """Run every thread for one control cycle.

        Raises:
            ScriptError: the program has failed, and has ended.
        """
        self._end_time = time.thread_time() + _MAX_TURN_TIME
        for thread in self.threads:  # threads started in this cycle are appended, and run in it
            if not thread.alive:
                continue
            self.current, self._steps = thread, 0
            try:
                next(thread.body)
            except StopIteration:
                if thread is self._main and self._host.arm.blends:
                    thread.body = self._finish_path()
                    continue
                thread.alive = False
                if thread is self._main:
                    break
            except _Halted:
                self._main.alive = False
                break
            except Exception as exc:  # whatever a text made Python do: it ends the program, never the controller
                self._main.alive = False
                raise self._translation.located(exc) from exc
        if len(self.threads) > 1:
            self.threads = [thread for thread in self.threads if thread.alive]

    def _finish_path(self) -> Generator[None, None, None]:
        """Wait for the end of a path whose blend no further move has begun."""
        while self._host.arm.blends:
            self.drive()
            yield

    def drive(self) -> None:
        """Claim the arm for the thread that runs now.

        Raises:
            ScriptError: another living thread moves it in this cycle, or the program is a ``sec`` one.
        """
        if self.secondary:
            raise ScriptError("a secondary program must not move the arm")
        cycle = self._host.cycle
        if self.driven == cycle and self.driver is not self.current and self.driver is not None and self.driver.alive:
            raise ScriptError("Another thread is already controlling the robot")
        self.driver, self.driven = self.current, cycle

    # called by the translated program

    def _run(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Thread:
        if len(self.threads) >= _MAX_THREADS:
            raise ScriptError(f"more than {_MAX_THREADS} threads")
        body = function(*arguments)
        thread = Thread(function.__name__[2:], body if isgenerator(body) else iter([]))
        self.threads.append(thread)
        return thread

    def _kill(self, thread: Any) -> None:
        if isinstance(thread, Thread) and thread.alive:
            if isinstance(thread.body, Generator):
                thread.body.close()
            thread.alive = False

    def _join(self, thread: Any) -> Generator[None, None, None]:
        while isinstance(thread, Thread) and thread.alive:
            yield

    def _pause(self) -> None:
        if self.secondary:
            raise ScriptError("a secondary program must not pause the main one")
        self._host.pause_program()

    def _halt(self) -> None:
        raise _Halted

    def _spent(self) -> bool:
        """Count a turn of a loop or a call; return whether the thread has used its time slice of this cycle.

        Raises:
            ScriptError: so has a ``sec`` program, which must take no time.
        """
        self._steps += 1
        spent = self._steps > _MAX_STEPS or time.thread_time() > self._end_time
        if spent and self.secondary:
            raise ScriptError("a secondary program must take no time, and this one has used its time slice")
        return spent

    def _method(self, base: Any, keys: Any, name: str, arguments: Any) -> Generator[None, None, tuple[Any, Any]]:
        """Call a method of what is found in a value; return the value after it, and what the method returns."""
        found = OPERATIONS["_at"](base, *keys)
        if isinstance(found, RemoteHandle | AbsentHandle):
            return base, (yield from found.call(name, arguments, self._host))
        after, result = call_method(found, name, arguments)
        return (base if after is found else OPERATIONS["_with"](after, keys, base)), result
