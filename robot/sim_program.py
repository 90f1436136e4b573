"""A URScript program that runs in the simulated controller: its threads, taking turns in each control cycle.

In a cycle the main thread goes first, then the others in the order in which they were started; each runs until it
blocks. Only one thread may move the arm in a cycle: as on the real controller, a second one ends the program.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from inspect import isgenerator
from typing import TYPE_CHECKING, Any

from .sim_builtins import Builtins
from .sim_urscript import Translation
from .sim_values import Array, PoseValue, ScriptError, copy

if TYPE_CHECKING:
    from .sim_controller import Controller

__all__ = ["Program", "Thread"]

TURNS = 100_000  #: loops within one cycle after which a program counts as one that never waits


class Thread:
    """One thread: a generator that yields where it waits for the next cycle."""

    __slots__ = ("alive", "body", "name")

    def __init__(self, name: str, body: Iterator[object]) -> None:
        self.name, self.body, self.alive = name, body, True


class _Halted(Exception):
    """``halt`` was reached."""


class Program:
    """One program: what its text compiled to, and where each of its threads is.

    Attributes:
        name: what the text calls it.
        secondary: a ``sec`` program: it runs beside the main one and must not move the arm.
        running: the main thread has not come to its end.
    """

    def __init__(self, controller: Controller, translation: Translation) -> None:
        self.controller = controller
        self.name, self.secondary = translation.name, translation.secondary
        self.driver: Thread | None = None  #: the thread that moves the arm
        self.driven = -1  #: the cycle in which it last did
        self.current: Thread
        self._critical: Thread | None = None
        self._loops = 0
        space: dict[str, Any] = {
            "Array": Array,
            "PoseValue": PoseValue,
            "_copy": copy,
            "_enter_critical": self._enter,
            "_exit_critical": self._leave,
            "_halt": self._halt,
            "_join": self._join,
            "_kill": self._kill,
            "_run": self._run,
            "_turn": self._turn,
        }
        builtins = Builtins(controller, self)
        space |= {f"b_{name}": getattr(builtins, name) for name in Builtins.names()}
        exec(translation.code, space)  # the text was parsed, and nothing but its own names is in it
        self._main = Thread("main", space["main"]())
        self.threads = [self._main]

    @property
    def running(self) -> bool:
        """The main thread has not come to its end."""
        return self._main.alive

    def turn(self) -> None:
        """One control cycle.

        Raises:
            ScriptError: the program did what it must not, and has ended.
        """
        self._loops = 0
        for thread in self.threads:  # threads started in this cycle are appended, and run in it
            if not thread.alive or (self._critical is not None and self._critical is not thread):
                continue
            self.current = thread
            try:
                next(thread.body)
            except StopIteration:
                self._end(thread)
                if thread is self._main:
                    break
            except _Halted:
                self._main.alive = False
                break
            except ScriptError:
                self._main.alive = False
                raise
            except (ArithmeticError, LookupError, NameError, TypeError, ValueError, AttributeError) as exc:
                self._main.alive = False
                raise ScriptError(f"{type(exc).__name__}: {exc}") from exc
        if len(self.threads) > 1:
            self.threads = [thread for thread in self.threads if thread.alive]

    def drive(self) -> None:
        """The thread that runs now moves the arm.

        Raises:
            ScriptError: another thread already does, or the program is a ``sec`` one.
        """
        if self.secondary:
            raise ScriptError("a secondary program must not move the arm")
        cycle = self.controller.cycle
        if self.driven == cycle and self.driver is not self.current:
            raise ScriptError("Another thread is already controlling the robot")
        self.driver, self.driven = self.current, cycle

    # what the translated program calls

    def _run(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Thread:
        body = function(*arguments)
        thread = Thread(function.__name__[2:], body if isgenerator(body) else iter([]))
        self.threads.append(thread)
        return thread

    def _kill(self, thread: Any) -> None:
        if isinstance(thread, Thread) and thread.alive:
            if isinstance(thread.body, Generator):
                thread.body.close()
            self._end(thread)

    def _end(self, thread: Thread) -> None:
        thread.alive = False
        if self._critical is thread:
            self._critical = None

    def _join(self, thread: Any) -> Generator[None, None, None]:
        while isinstance(thread, Thread) and thread.alive:
            yield

    def _enter(self) -> None:
        self._critical = self.current

    def _leave(self) -> None:
        self._critical = None

    def _halt(self) -> None:
        raise _Halted

    def _turn(self) -> None:
        self._loops += 1
        if self._loops > TURNS:
            raise ScriptError("an endless loop without sync() or sleep()")
