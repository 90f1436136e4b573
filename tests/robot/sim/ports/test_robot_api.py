"""The robot API of PolyScope X, request by request, as Universal Robots' client library makes them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from coneskin.robot.sim.ports.robot_api import BASE_PATH, Request, RequestReader, RobotApi
from tests.robot.sim.ports.console import WAIT, Console, packed


class Api:
    """Robot API of a controller, and its requests."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.api = RobotApi(console.interface)

    def get(self, path: str) -> Any:
        answer = self.api.answer(Request("GET", BASE_PATH + path, {}))
        return answer.content if answer.status == 200 else answer.status

    def put(self, path: str, **fields: str) -> int:
        return self.api.answer(Request("PUT", BASE_PATH + path, {}, json.dumps(fields).encode())).status

    def upload(self, method: str, data: bytes) -> tuple[int, Any]:
        body = b'--xx\r\nContent-Disposition: form-data; name="file"; filename="f"\r\n\r\n' + data + b"\r\n--xx--\r\n"
        headers = {"content-type": "multipart/form-data; boundary=xx"}
        answer = self.api.answer(Request(method, f"{BASE_PATH}/programs/v1/", headers, body))
        return answer.status, answer.content


@pytest.fixture
def api(tmp_path: Path) -> Api:
    (tmp_path / "wait_program.urp").write_bytes(packed(WAIT))
    return Api(Console(tmp_path, version=(10, 12)))


def test_the_version_of_the_api_follows_the_software(api: Api) -> None:
    assert api.get("/openapi.json")["info"]["version"] == "3.1.4"
    early = Api(Console(version=(10, 11)))
    assert early.get("/openapi.json")["info"]["version"] == "1.0.0"
    assert early.get("/program/v1/loaded") == 404


def test_a_program_is_loaded_played_paused_resumed_and_stopped(api: Api) -> None:
    assert api.get("/program/v1/loaded") == {"name": "Default program"}
    assert api.put("/program/v1/state", action="play") == 409
    assert api.put("/program/v1/loaded", name="wait_program") == 200
    assert api.get("/program/v1/loaded") == {"name": "wait_program"}
    assert api.put("/program/v1/state", action="play") == 200
    api.console.step(10)
    for action, state in (("pause", "PAUSED"), ("resume", "PLAYING"), ("stop", "STOPPED")):
        assert api.put("/program/v1/state", action=action) == 200
        assert api.get("/program/v1/state") == {"state": state}
    assert api.put("/program/v1/state", action="resume") == 409
    assert api.put("/program/v1/state", action="dance") == 400
    assert api.put("/program/v1/loaded", name="none") == 404


def test_the_arm_is_switched_on_and_unlocked(api: Api) -> None:
    for action, mode in (("POWER_OFF", "POWER_OFF"), ("POWER_ON", "IDLE"), ("BRAKE_RELEASE", "RUNNING")):
        assert api.put("/robotstate/v1/state", action=action) == 200
        assert api.get("/robotstate/v1/robotmode") == {"mode": mode}
    api.console.controller.protective_stop("test")
    assert api.get("/robotstate/v1/safetymode") == {"mode": "PROTECTIVE_STOP"}
    assert api.put("/robotstate/v1/state", action="UNLOCK_PROTECTIVE_STOP") == 200
    assert api.get("/robotstate/v1/safetymode") == {"mode": "NORMAL"}
    api.console.controller.emergency_stop()
    assert api.get("/robotstate/v1/safetymode") == {"mode": "EMERGENCY_STOP"}
    assert api.put("/robotstate/v1/state", action="JUMP") == 400


def test_modes_are_told(api: Api) -> None:
    assert api.get("/system/v1/controlmode") == {"mode": "REMOTE"}
    assert Api(Console(version=(10, 12), remote_control=False)).get("/system/v1/controlmode") == {"mode": "LOCAL"}
    assert api.get("/system/v1/operationalmode") == {"mode": "MANUAL"}


def test_programs_are_uploaded_updated_listed_downloaded_and_run(api: Api) -> None:
    facts = {"name": "test upload", "description": "d", "createdDate": 5}
    program = {"program": {"programInformation": facts, "urscript": {"script": "sleep(1)"}}}
    data = json.dumps(program).encode()
    assert api.upload("PUT", data)[0] == 404
    assert api.upload("POST", data) == (200, {"programName": "test upload"})
    assert api.upload("POST", data)[0] == 400
    assert api.upload("PUT", data)[0] == 200
    assert api.upload("POST", b"no program")[0] == 400
    assert api.get("/programs/v1/test upload") == program
    assert api.get("/programs/v1/none") == 404
    listed = {entry["name"]: entry for entry in api.get("/programs/v1/")["programs"]}
    assert sorted(listed) == ["test upload", "wait_program"]
    assert listed["test upload"]["createdDate"] == 5
    assert api.put("/program/v1/loaded", name="test upload") == 200
    assert api.put("/program/v1/state", action="play") == 200
    api.console.step(10)
    assert api.get("/program/v1/state") == {"state": "PLAYING"}


def test_a_program_never_lands_outside_the_folder(api: Api, tmp_path: Path) -> None:
    program = {"program": {"programInformation": {"name": "../out"}, "urscript": {"script": ""}}}
    status, content = api.upload("POST", json.dumps(program).encode())
    assert status == 400
    assert "cannot be stored" in content["message"]
    assert not list(tmp_path.parent.glob("out*"))


def test_a_web_page_of_any_origin_can_do_nothing(api: Api, tmp_path: Path) -> None:
    """A browser sends a POST of plain text to any port, whatever page asks for it."""
    body = json.dumps({"program": {"programInformation": {"name": "foreign"}}}).encode()
    headers = {"origin": "http://example.com", "content-type": "text/plain"}
    assert api.api.answer(Request("POST", f"{BASE_PATH}/programs/v1/", headers, body)).status == 403
    assert not (tmp_path / "foreign.urpx").exists()


def test_what_is_not_there_is_refused(api: Api) -> None:
    assert api.get("/robotstate/v2/robotmode") == 404
    assert api.put("/robotstate/v1/robotmode") == 405
    assert api.api.answer(Request("GET", "/", {})).status == 404
    assert api.api.answer(Request("PUT", f"{BASE_PATH}/program/v1/state", {}, b"{")).status == 400
    assert api.api.answer(Request("PUT", f"{BASE_PATH}/program/v1/state", {}, b"[1]")).status == 400


def test_requests_are_read_whole_however_they_come(api: Api) -> None:
    read = RequestReader(api.api.answer)
    body = b'{"action": "POWER_OFF"}'
    asked = f"PUT {BASE_PATH}/robotstate/v1/state HTTP/1.1\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body
    asked += f"GET {BASE_PATH}/robotstate/v1/robotmode?x=1 HTTP/1.1\r\nHost: a\r\n\r\n".encode()
    answers = b"".join(read(asked[i : i + 1]) for i in range(len(asked)))
    assert answers.count(b"HTTP/1.1 200 OK\r\n") == 2
    assert answers.endswith(b'{"mode": "POWER_OFF"}')


@pytest.mark.parametrize(
    "data",
    [
        b"HELLO\r\n\r\n",
        b"GET / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n",
        b"GET / HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n",
        b"x" * 20_000,
    ],
)
def test_what_is_no_request_ends_the_connection(api: Api, data: bytes) -> None:
    with pytest.raises(ValueError, match=r".+"):
        RequestReader(api.api.answer)(data)
