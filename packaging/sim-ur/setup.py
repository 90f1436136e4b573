"""The simulated controller as a distribution of its own: ``pip install ./packaging/sim-ur``.

It has what the simulator imports of coneskin, under the name ``sim_ur``, so that both can be installed. The modules are
written to sim_ur/ here, from this repository's; a source distribution brings them.
"""

import ast
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SOURCE = ROOT / "src"
STARTS = ("coneskin.robot.sim.command", "coneskin.robot.sim.process")
FIXTURE = "ur_controller"  # of coneskin/runs/pytest_plugin.py


def path(module: str) -> Path:
    """Return the file of a module, whether it exists or not."""
    folder = SOURCE.joinpath(*module.split("."))
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


def imported(module: str) -> Iterator[str]:
    """Yield what a module imports, and the packages that it is in."""
    yield module.rpartition(".")[0]
    package = module.split(".") if path(module).name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path(module).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            yield from (base, *(f"{base}.{name.name}" for name in node.names))


def renamed(text: str) -> str:
    """Return a module's text as it is in this distribution."""
    command = text.replace("coneskin sim-ur", "sim-ur").replace('"coneskin "', '"sim-ur "')
    return re.sub(r"\bconeskin\b", "sim_ur", command)


def write(target: Path) -> None:
    """Write the package: the modules, the fixture of coneskin's plugin, and what a user imports."""
    shutil.rmtree(target, ignore_errors=True)
    found, waiting = set(), list(STARTS)
    while waiting:
        module = waiting.pop()
        if module.startswith("coneskin.") and module not in found and path(module).exists():
            found.add(module)
            waiting += imported(module)
    for module in found:
        file = target / path(module).relative_to(SOURCE / "coneskin")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(renamed(path(module).read_text(encoding="utf-8")), encoding="utf-8")
    plugin = ast.parse((SOURCE / "coneskin" / "runs" / "pytest_plugin.py").read_text(encoding="utf-8")).body
    fixture = next(node for node in plugin if isinstance(node, ast.FunctionDef) and node.name == FIXTURE)
    header = f'"""The fixture ``{FIXTURE}``."""\n\nfrom __future__ import annotations\n\nimport pytest\n\n\n'
    (target / "pytest_plugin.py").write_text(renamed(header + ast.unparse(fixture) + "\n"), encoding="utf-8")
    version = re.search(
        r'^__version__.*"(.+)"', path("coneskin.core.version").read_text(encoding="utf-8"), re.MULTILINE
    )
    (target / "__init__.py").write_text(
        '"""A simulated UR controller."""\n\n'
        "from sim_ur.robot.sim.process import SimulatedController as SimulatedController\n"
        f'\n__version__ = "{version[1]}"\n',
        encoding="utf-8",
    )
    shutil.copy(ROOT / "LICENSE", target.parent)


if (SOURCE / "coneskin" / "robot" / "sim").exists():
    write(HERE / "sim_ur")
setup()
