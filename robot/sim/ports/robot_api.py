"""Robot API of PolyScope X, as far as Universal Robots' client library asks it: bytes in, answers out. No sockets.

The library reads version 1.0 of the API (PolyScope 10.11) and 3.1.4 (from 10.12 on). Where an action cannot be carried
out the answer is 409; for what does not exist 404, for a request that cannot be read 400. Of HTTP/1.1 there is what
this needs: a body has its length in a header, and chunks are not taken.

Source: the calls of Universal Robots' client library, c5d1e26; the published specification was not at hand. RFC 9112
(messages) and RFC 7578 (form data).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import unquote

from coneskin.robot.sim.machine.states import SafetyMode
from coneskin.robot.sim.urscript.values import ScriptError

from .program_file import program_information
from .user_interface import NO_MODE, UserInterface

__all__ = ["BASE_PATH", "Answer", "Request", "RequestReader", "RobotApi"]

_MAX_HEAD = 16_000  # bytes of the request line and the headers
_MAX_BODY = 2_000_000  # bytes; a program of PolyScope X that only waits has 100 000
_STATUS_REASONS = {
    **{200: "OK", 400: "Bad Request", 403: "Forbidden"},
    **{404: "Not Found", 405: "Method Not Allowed", 409: "Conflict"},
}


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a client.

    Attributes:
        method: such as GET.
        path: without the query, decoded.
        headers: name in small letters -> value.
        body: what follows them.
    """

    method: str
    path: str
    headers: dict[str, str]
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a request.

    Attributes:
        status: number of HTTP.
        content: what is sent, as JSON.
    """

    status: int
    content: object

    def encode(self) -> bytes:
        """Return the bytes of the answer."""
        body = json.dumps(self.content).encode()
        head = (
            f"HTTP/1.1 {self.status} {_STATUS_REASONS.get(self.status, 'Error')}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        return head.encode() + body


class RequestReader:
    """Reader of requests: bytes in, answers to whole requests out."""

    def __init__(self, answer: Callable[[Request], Answer]) -> None:
        self._answer = answer
        self._rest = b""

    def __call__(self, data: bytes) -> bytes:
        """Take bytes, and return the answers to the requests that they complete.

        Raises:
            ValueError: they are not a request, or it is too long.
        """
        self._rest += data
        answers = b""
        while (end := self._rest.find(b"\r\n\r\n")) >= 0:
            request = _parse_head(self._rest[:end])
            size = _length(request)
            if len(self._rest) < end + 4 + size:
                return answers
            body, self._rest = self._rest[end + 4 : end + 4 + size], self._rest[end + 4 + size :]
            answers += self._answer(Request(request.method, request.path, request.headers, body)).encode()
        if len(self._rest) > _MAX_HEAD:
            raise ValueError(f"a request has at most {_MAX_HEAD} bytes of headers")
        return answers


def _parse_head(head: bytes) -> Request:
    first, *lines = head.decode("latin-1").split("\r\n")
    match = re.fullmatch(r"([A-Z]+) (/\S*) HTTP/1\.[01]", first)
    if match is None:
        raise ValueError(f"not a request: {first[:100]!r}")
    pairs = (line.partition(":") for line in lines)
    headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
    return Request(match[1], unquote(match[2].partition("?")[0]), headers)


def _length(request: Request) -> int:
    if "transfer-encoding" in request.headers:
        raise ValueError("a body in chunks is not taken")
    length = request.headers.get("content-length", "0")
    if not re.fullmatch(r"[0-9]{1,9}", length) or int(length) > _MAX_BODY:
        raise ValueError(f"the length of a body is a number up to {_MAX_BODY}, got {length[:20]!r}")
    return int(length)


def _uploaded_file(request: Request) -> bytes:
    """Return the file that a form uploads; the whole body where it is no form.

    Raises:
        ValueError: the form has no file.
    """
    match = re.match(r'multipart/form-data;.*boundary="?([^";]+)"?', request.headers.get("content-type", ""))
    if match is None:
        return request.body
    for part in request.body.split(b"--" + match[1].encode())[1:]:
        head, found, content = part.partition(b"\r\n\r\n")
        if found and b'name="file"' in head:
            return content.removesuffix(b"\r\n")
    raise ValueError("the form has no part named file")


BASE_PATH = "/universal-robots/robot-api"  #: with which every path begins
_DEFAULT_PROGRAM = "Default program"  # name of the one that is loaded at first
_PROGRAM_SUFFIXES = (".urpx", ".urp", ".script")  # of the files that a name may stand for
_EMERGENCY_STOPS = (SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SYSTEM_EMERGENCY_STOP)
#: action -> command of the power
_POWER_ACTIONS = {
    "POWER_ON": "power on",
    "POWER_OFF": "power off",
    "BRAKE_RELEASE": "brake release",
    "RESTART_SAFETY": "restart safety",
}


class RobotApi:
    """Robot API of one controller."""

    def __init__(self, interface: UserInterface) -> None:
        self._i = interface
        self._c = interface.controller
        self._early = self._c.options.version < (10, 12)
        self._gets: dict[str, Callable[[], object]] = {
            "/openapi.json": self._specification,
            "/program/v1/state": self._state,
        }
        self._puts: dict[str, Callable[[Request], Answer]] = {
            "/program/v1/state": self._act_on_program,
            "/robotstate/v1/state": self._act_on_robot,
        }
        if self._early:
            self._puts["/program/v1/load"] = lambda request: self._load(request, "programName")
            return
        self._puts |= {"/program/v1/loaded": lambda request: self._load(request, "name")}
        self._gets |= {
            "/program/v1/loaded": lambda: {"name": self._loaded},
            "/programs/v1/": self._programs,
            "/robotstate/v1/robotmode": lambda: {"mode": self._c.robot_mode.name},
            "/robotstate/v1/safetymode": self._mode_of_stop,
            "/system/v1/controlmode": lambda: {"mode": "REMOTE" if self._c.options.remote_control else "LOCAL"},
            "/system/v1/operationalmode": self._operational_mode,
        }

    def answer(self, request: Request) -> Answer:
        """Act on a request, and return the answer."""
        self._c.log("robot_api", method=request.method, path=request.path)
        if "origin" in request.headers:  # a browser sends it, and whose page it shows nobody knows
            return _refuse(403, "the robot API takes no requests of web pages")
        path = request.path.removeprefix(BASE_PATH)
        try:
            if path == request.path:
                return _refuse(404, f"there is nothing at {request.path}; every path begins with {BASE_PATH}")
            if request.method == "GET" and path in self._gets:
                return Answer(200, self._gets[path]())
            if request.method == "PUT" and path in self._puts:
                return self._puts[path](request)
            if not self._early and path.startswith("/programs/v1/"):
                return self._file(request, path.removeprefix("/programs/v1/"))
        except ValueError as exc:  # json.JSONDecodeError is one
            return _refuse(400, str(exc))
        known = path in self._gets or path in self._puts
        return _refuse(405 if known else 404, f"{request.method} {path} is not part of the robot API")

    # what is asked

    def _specification(self) -> object:
        version = "1.0.0" if self._early else "3.1.4"
        paths: dict[str, dict[str, object]] = {}
        for method, known in (("get", self._gets), ("put", self._puts)):
            for path in known:
                paths.setdefault(path, {})[method] = {}
        return {"openapi": "3.1.0", "info": {"title": "Robot API", "version": version}, "paths": paths}

    def _state(self) -> object:
        return {"state": self._c.runtime.word}

    def _mode_of_stop(self) -> object:
        mode = self._c.safety
        return {"mode": "EMERGENCY_STOP" if mode in _EMERGENCY_STOPS else mode.name}

    def _operational_mode(self) -> object:
        mode = self._i.operational_mode
        return {"mode": "MANUAL" if mode == NO_MODE else mode}

    @property
    def _loaded(self) -> str:
        return self._i.loaded.name.rpartition(".")[0] if self._i.loaded is not None else _DEFAULT_PROGRAM

    def _programs(self) -> object:
        found = []
        for name in self._i.folder.names(*_PROGRAM_SUFFIXES):
            stem, _, suffix = name.rpartition(".")
            facts: dict[str, object] = {"name": stem, "description": "", "programState": "FINAL"}
            facts |= {"createdDate": 0, "lastSavedDate": None, "lastModifiedDate": None}
            if suffix == "urpx":
                try:
                    facts |= program_information(self._i.folder.read(name))
                except (OSError, ValueError) as exc:
                    self._c.log("refused", program=name, reason=str(exc))
                    continue
            found.append(facts)
        return {"programs": found}

    # what is done

    def _act_on_program(self, request: Request) -> Answer:
        action = _field(request, "action").lower()
        runtime = self._c.runtime
        if action == "play":
            done = not runtime.paused and self._i.play()
        elif action == "resume":
            done = self._c.resume_program()
        elif action == "pause":
            done = self._c.pause_program()
        elif action == "stop":
            done = True
            self._i.stop("robot API")
        else:
            return _refuse(400, f"action must be play, pause, resume or stop, got {action!r}")
        state = f"{runtime.name}, {self._c.safety.name}, {self._c.robot_mode.name}"
        return _done(done, f"{action} is not possible: {state}")

    def _act_on_robot(self, request: Request) -> Answer:
        action = _field(request, "action")
        if action == "UNLOCK_PROTECTIVE_STOP":
            return _done(self._c.unlock(early=True), "it cannot be unlocked")
        if action not in _POWER_ACTIONS:
            known = ", ".join((*_POWER_ACTIONS, "UNLOCK_PROTECTIVE_STOP"))
            return _refuse(400, f"action must be one of {known}, got {action!r}")
        self._c.switch_power(_POWER_ACTIONS[action])
        return Answer(200, {"message": action})

    def _load(self, request: Request, key: str) -> Answer:
        name = _field(request, key)
        file = self._stored(name)
        if file is None:
            return _refuse(404, f"there is no program {name!r}")
        try:
            self._i.load(file)
        except (OSError, ScriptError) as exc:
            return _refuse(400, str(exc))
        return Answer(200, {"name": name})

    def _stored(self, name: str) -> str | None:
        """Return the file of a program; None where there is none."""
        return next((name + suffix for suffix in _PROGRAM_SUFFIXES if self._i.folder.has(name + suffix)), None)

    def _file(self, request: Request, name: str) -> Answer:
        if request.method == "GET":
            file = self._stored(name)
            if file is None or not file.endswith(".urpx"):
                return _refuse(404, f"there is no program {name!r} of PolyScope X")
            return Answer(200, json.loads(self._i.folder.read(file)))
        if name or request.method not in ("POST", "PUT"):
            return _refuse(405, f"{request.method} is not possible for a program")
        data = _uploaded_file(request)
        known = str(program_information(data)["name"])
        exists = self._stored(known) is not None
        if exists != (request.method == "PUT"):
            problem = "exists already" if exists else "does not exist"
            return _refuse(400 if exists else 404, f"the program {known!r} {problem}")
        try:
            self._i.folder.save(f"{known}.urpx", data)
        except OSError as exc:
            return _refuse(400, f"the program {known!r} cannot be stored: {type(exc).__name__}")
        self._c.log("stored", program=known)
        return Answer(200, {"programName": known})


def _field(request: Request, key: str) -> str:
    found = json.loads(request.body or b"null")
    if not isinstance(found, dict) or not isinstance(found.get(key), str):
        raise ValueError(f"the request needs the text {key!r} as JSON")
    return str(found[key])


def _done(done: bool, problem: str) -> Answer:
    return Answer(200, {"message": "done"}) if done else _refuse(409, problem)


def _refuse(status: int, problem: str) -> Answer:
    return Answer(status, {"message": problem, "details": problem})
