"""Children of a session: the guard ends first, and a guard watchdog is not killed while the arm moves."""

import subprocess

import pytest

from coneskin.session.child_processes import ChildProcesses


class _Child:
    def __init__(self, name: str, hangs: bool, said: list[str]) -> None:
        self._name, self._hangs, self._said = name, hangs, said

    def wait(self, timeout: float | None = None) -> None:
        self._said.append(f"{self._name} is waited for")
        if self._hangs and timeout is not None:
            raise subprocess.TimeoutExpired(self._name, timeout)

    def kill(self) -> None:
        self._said.append(f"{self._name} is killed")


@pytest.mark.parametrize("stands", [False, True])
def test_children_end_in_order_and_a_watchdog_is_spared_until_the_arm_stands(stands: bool) -> None:
    processes, said = ChildProcesses(), []
    processes.children = {name: _Child(name, name != "guard", said) for name in ("watchdog", "guard", "skin")}
    for _ in range(2):  # the second time there is nothing left to end
        processes.end(lambda: stands)
    killed = ["watchdog is killed", "watchdog is waited for"] if stands else []
    assert said == [
        *("guard is waited for", "watchdog is waited for", *killed),
        *("skin is waited for", "skin is killed", "skin is waited for"),
    ]
