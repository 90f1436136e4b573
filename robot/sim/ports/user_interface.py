"""State of PolyScope behind the dashboard: its disk, the loaded program, modes, log messages, reports.

PolyScope writes the URScript of a program beside its ``.urp`` file, in a ``.script`` file of the same name, and that is
what runs. A line in it may stand for the script of an External Control node.

The script of an External Control node is asked for at ``play``, from the program that has it, without holding a cycle
up. That program listens on a TCP port and answers the line ``request_program`` with URScript. Nothing marks its end, so
that it ends with the connection or with a pause. Source: Universal Robots, External Control URCap and client library.
"""

from __future__ import annotations

import io
import json
import re
import socket
import threading
import time
import zipfile
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

from coneskin.core.files import read_file
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.urscript.translator import MAX_LENGTH
from coneskin.robot.sim.urscript.values import ScriptError

#: line that stands for the script of an External Control node until ``play`` has asked for it
EXTERNAL_CONTROL = "# script of the node External Control"


@dataclass(frozen=True, slots=True)
class _ProgramFile:
    """Program that is loaded."""

    name: str  #: of its file, with the extension
    path: str  #: of its file, as PolyScope gives it
    text: str  #: its URScript, from ``def`` to ``end``

    @property
    def function(self) -> str:
        """Name of the program in its text; empty where it has none."""
        match = re.search(r"^[ \t]*def[ \t]+(\w+)", self.text, re.MULTILINE)
        return match[1] if match else ""


def _program_text(name: str, data: bytes) -> str:
    """Return the URScript of a ``.script`` file: as it is, or as the body of a program of the file's name."""
    text = data.decode("utf-8", "replace")
    lines = (line.strip() for line in text.splitlines())
    first = next((line for line in lines if line and not line.startswith("#")), "")
    function = re.sub(r"\W", "_", name.rpartition(".")[0]) or "program"
    return text if first.startswith("def ") else f"def {function}():\n{text}\nend\n"


#: where PolyScope has its programs, on a robot and in Universal Robots' own simulator
_PROGRAM_ROOTS = ("/ursim/programs/", "/programs/")
_MAX_PROGRAM_SIZE = 4 * MAX_LENGTH  # bytes of a file


class _ProgramFolder:
    """Folder with the programs that the dashboard can load; sub-folders count, and nothing outside it does.

    Args:
        root: the folder; without one no file is found, and nothing can be saved.
    """

    def __init__(self, root: Path | None) -> None:
        self.root = root.resolve() if root is not None else None

    def locate(self, name: str) -> Path:
        """Return the path of a file in the folder.

        Args:
            name: relative to the folder, or from ``/programs/`` or ``/ursim/programs/``.

        Raises:
            FileNotFoundError: it would be outside, or there is no folder.
        """
        for start in _PROGRAM_ROOTS:
            name = name.removeprefix(start)
        if self.root is None or not name or "\0" in name:
            raise FileNotFoundError(name)
        try:
            path = (self.root / name).resolve()
        except (RuntimeError, ValueError) as exc:  # links in a circle, a name that no file can have
            raise FileNotFoundError(name) from exc
        if not path.is_relative_to(self.root):
            raise FileNotFoundError(name)
        return path

    def load(self, name: str) -> _ProgramFile:
        """Return a program.

        Raises:
            FileNotFoundError: there is no such file.
            OSError: it cannot be read, or is too long.
            ScriptError: it has no ``.script`` file beside it.
        """
        path = self.locate(name)
        if not path.is_file():
            raise FileNotFoundError(name)
        source = path.with_suffix(".script") if path.suffix == ".urp" else path
        if not source.is_file():
            raise ScriptError(
                f"{name} has no {source.name} beside it, which PolyScope writes with it. For one of the "
                f"node External Control alone, write that file, with the line {EXTERNAL_CONTROL!r}"
            )
        assert self.root is not None
        shown = f"{_PROGRAM_ROOTS[1]}{path.relative_to(self.root).as_posix()}"
        return _ProgramFile(path.name, shown, _program_text(path.name, read_file(source, _MAX_PROGRAM_SIZE)))

    def has(self, name: str) -> bool:
        """Return whether there is such a file."""
        try:
            return self.locate(name).is_file()
        except FileNotFoundError:
            return False

    def save(self, name: str, data: bytes) -> Path:
        """Write a file into the folder, and return its path.

        Raises:
            OSError: it cannot be written, would be outside, or there is no folder.
        """
        path = self.locate(name)
        path.write_bytes(data)
        return path


_SCRIPT_REQUEST = b"request_program\n"
_CONNECT_TIMEOUT = 2.0  # s
_FIRST_TIMEOUT = 2.0  # s; until the script begins to come
_SCRIPT_PAUSE = 0.1  # s; the script has come to its end when nothing more comes for so long


def _request_script(address: tuple[str, int]) -> Future[str]:
    """Ask the program at an address for a script, in a thread that ends with this process."""
    script: Future[str] = Future()

    def ask() -> None:
        try:
            with socket.create_connection(address, _CONNECT_TIMEOUT) as sock:
                sock.sendall(_SCRIPT_REQUEST)
                script.set_result(_read(sock).decode("utf-8", "replace"))
        except OSError as exc:
            script.set_exception(exc)

    threading.Thread(target=ask, daemon=True).start()
    return script


def _read(sock: socket.socket) -> bytes:
    """Read until the other side closes, or pauses after its first bytes.

    Raises:
        OSError: nothing comes, or too much.
    """
    text = b""
    end = time.monotonic() + _FIRST_TIMEOUT
    while time.monotonic() < end or text:
        sock.settimeout(_SCRIPT_PAUSE if text else _FIRST_TIMEOUT)
        try:
            more = sock.recv(65536)
        except TimeoutError:
            break
        if not more:
            break
        text += more
        if len(text) > MAX_LENGTH:
            raise OSError(f"the script has more than {MAX_LENGTH} characters")
    if not text:
        raise OSError("no script came")
    return text


SERIAL_NUMBER = "20250000001"  #: of every simulated arm
_MAX_MESSAGES = 1000  # log messages that are kept
_MAX_REPORTS = 10  # flight reports that are kept
NO_MODE = "NONE"  #: operational mode that no client controls


class UserInterface:
    """PolyScope of one controller.

    Args:
        controller: runs the programs.
        run: takes the text of a program and starts it once it is translated.
        check: raises a ScriptError where the text of a program cannot be translated, as far as that shows at once.

    Attributes:
        run: as given.
        folder: its disk.
        loaded: program that ``play`` starts; None before the first.
        operational_mode: that a client has set; NO_MODE where none has.
        user_role: of CB3.
    """

    def __init__(
        self, controller: Controller, run: Callable[[str], None], check: Callable[[str], object] = lambda _: None
    ) -> None:
        options = controller.options
        self.controller = controller
        self.folder = _ProgramFolder(options.programs)
        self.loaded = _ProgramFile("play.script", "play.script", options.program) if options.program else None
        self.operational_mode = NO_MODE
        self.user_role = "PROGRAMMER"
        self.messages: deque[str] = deque(maxlen=_MAX_MESSAGES)
        self.reports: deque[str] = deque(maxlen=_MAX_REPORTS)
        self.run = run
        self._check = check
        self._request: Future[str] | None = None
        self._count = 0

    # programs

    def load(self, name: str) -> None:
        """Load a program; the one that runs is stopped.

        Raises:
            FileNotFoundError: there is no such file.
            OSError: it cannot be read.
            ScriptError: it is not a program, or not one that is simulated.
        """
        loaded = self.folder.load(name)
        self.stop("another program was loaded")
        self.loaded = loaded
        self.controller.log("loaded", program=loaded.path)

    def play(self) -> bool:
        """Go on with the paused program, or start the loaded one; return False where neither is possible.

        A short program that cannot be translated is told to all clients, and is not started; of a long one they are
        told later.
        """
        controller = self.controller
        if controller.resume_program():
            return True
        if controller.runtime.paused or self.loaded is None:
            return False
        if controller.program is not None or self._request is not None:
            return True  # it runs, or is about to
        if not controller.ready:
            return False
        try:
            self._check(self.loaded.text)
        except ScriptError as exc:
            controller.fail(self.loaded.name, exc)
            return False
        if EXTERNAL_CONTROL in self.loaded.text:
            self._request = _request_script(controller.options.external_control)
        else:
            self.run(self.loaded.text)
        return True

    def turn(self) -> None:
        """Start the loaded program once the script of its External Control node has come; called in each cycle."""
        if self._request is None or self.loaded is None or not self._request.done():
            return
        request, self._request = self._request, None
        try:
            self.run(self.loaded.text.replace(EXTERNAL_CONTROL, request.result()))
        except OSError as exc:
            host, port = self.controller.options.external_control
            problem = f"the node External Control got no script from {host} port {port}: {exc}"
            self.controller.fail(self.loaded.name, ScriptError(problem))

    def stop(self, reason: str) -> None:
        """Stop the program that runs, or is about to."""
        self._request = None
        self.controller.stop_program(reason)

    @property
    def program_name(self) -> str:
        """Name of the program that runs; where none does, of the one that is loaded."""
        running, loaded = self.controller.program, self.loaded
        if running is not None and (loaded is None or running.name != loaded.function):
            return running.name
        return loaded.name if loaded is not None else "<unnamed>"

    # log and reports

    def save_log(self) -> None:
        """Write the log messages of clients to the folder.

        Raises:
            OSError: that is not possible, or there is no folder.
        """
        self.folder.save("log_history.txt", "".join(f"{line}\n" for line in self.messages).encode())

    def report(self, kind: str) -> int:
        """Keep the present state as a flight report; return its number."""
        self._count += 1
        facts = {"id": self._count, "type": kind or "system", "state": self.controller.describe()}
        self.reports.append(json.dumps(facts))
        return self._count

    def support_file(self, folder: str) -> str:
        """Write log messages and flight reports, packed, into a folder on the disk; return the file's path there.

        Raises:
            OSError: that is not possible, or there is no such folder.
        """
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("log_history.txt", "\n".join(self.messages))
            for number, text in enumerate(self.reports, 1):
                archive.writestr(f"flight_reports/{number}.json", text)
        name = f"ur_{SERIAL_NUMBER}_{self.controller.cycle}.zip"
        where = name if folder in ("", ".", "/") else f"{folder}/{name}"
        self.folder.save(where, packed.getvalue())
        return where
