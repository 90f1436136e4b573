"""Nothing of a guard listens on the network: the simulated controller and the pages do, and say so (docs/safety.md)."""

import ast
from pathlib import Path

import pytest

from .test_house import ROOT, sources

_OPENS_A_PORT = {"listen", "create_server", "start_server", "start_unix_server", "bind"}


def _calls(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {
        node.func.attr for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
    }
    servers = {"socketserver", "http.server", "xmlrpc.server", "multiprocessing.managers", "multiprocessing.connection"}
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    return (names & _OPENS_A_PORT) | (imported & servers)


#: a name on this computer, at which who is refused asks whose it is; nothing is read from it
_NAMES = {"src/coneskin/session/guard_run.py": {"bind", "listen"}}
_PAGES = {"src/coneskin/view/page_server.py": {"bind"}}  # viser listens: of a page to look at, or of the designer's
_PUBLISHER = {"src/coneskin/session/event_publisher.py": {"bind"}}  # of ZeroMQ, where --publish asks for it


@pytest.mark.long
@pytest.mark.promise("P65")
def test_only_the_simulated_controller_and_the_pages_open_ports() -> None:
    found = {str(path.relative_to(ROOT)): opened for path in sources() if (opened := _calls(path))}
    simulator = {"robot/sim/server.py": {"bind", "listen"}, "robot/sim/process.py": {"bind"}}
    assert found == {**simulator, **_NAMES, **_PAGES, **_PUBLISHER}
