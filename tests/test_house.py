"""The rules of the house, read from the source: arrows, dependencies, exports, docstrings, packages, names."""

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("geometry", "skin", "robot")
#: what each package may import of coneskin; robot -> skin -> geometry, never back
MAY_IMPORT = {
    "geometry": {"geometry", "errors", "arrays"},
    "skin": {"skin", "geometry", "errors", "arrays"},
    "robot": {"robot", "skin", "geometry", "errors", "arrays"},
}
#: the only files that may import each heavy dependency, as globs
HOMES = {
    "serial": ("skin/serial_port.py",),
    "rtde_control": ("robot/ur_rtde.py",),
    "rtde_receive": ("robot/ur_rtde.py",),
    "rtde_io": ("robot/ur_rtde.py",),
    "dashboard_client": ("robot/ur_rtde.py",),
    "trimesh": ("geometry/mesh.py",),
    "embreex": ("geometry/mesh.py",),
    "collada": ("geometry/mesh.py",),
    "ezdxf": ("geometry/dxf.py",),
    "matplotlib": ("*/*_picture*.py", "*/*_figure*.py", "src/coneskin/*_picture*.py", "src/coneskin/*_figure*.py"),
    "tomli_w": ("src/coneskin/link_tables.py",),
    "scipy": ("geometry/fit_*.py", "skin/field_*.py"),
}
#: the live path: no numpy in any of it
HOT = {
    "skin": "wire source serial_port stream detector reading sensor timing events recording",
    "robot": "kinematics compiled reaction retreat damped limits guard_core guard_loop arm_reaction owner channel "
    "state_reader stop_watch ur_rtde journal",
}


@cache
def sources() -> tuple[Path, ...]:
    """Our modules, by their true paths."""
    found = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
    return tuple(sorted([*found, *(ROOT / "src" / "coneskin").glob("*.py")]))


def name_of(path: Path) -> str:
    """Import name of a module."""
    parts = path.relative_to(ROOT / "src" if "src" in path.relative_to(ROOT).parts else ROOT).with_suffix("").parts
    parts = parts if parts[0] == "coneskin" else ("coneskin", *parts)
    return ".".join(parts).removesuffix(".__init__")


@cache
def imports(path: Path) -> tuple[tuple[str, int, bool], ...]:
    """Full names that a module imports, the lazy ones inside functions too; the line; whether at the top."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[tuple[str, int, bool]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = name_of(path) if path.name == "__init__.py" else name_of(path).rpartition(".")[0]
    for node in ast.walk(tree):
        top = node in tree.body
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno, top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            yield from ((f"{base}.{alias.name}", node.lineno, top) for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            constant = node.args[0]
            yield (str(constant.value) if isinstance(constant, ast.Constant) else "?"), node.lineno, top


IDS = [str(path.relative_to(ROOT)) for path in sources()]
each_source = pytest.mark.parametrize("path", sources(), ids=IDS)


def test_the_reader_of_imports_sees_every_kind() -> None:
    """Otherwise the tests below could not fail."""
    assert {name for name, _, _ in imports(ROOT / "robot" / "guard_core.py")} >= {
        "coneskin.skin.stream.Stream",
        "coneskin.robot.journal.Kind",
    }
    assert ("serial", False) in {(name, top) for name, _, top in imports(ROOT / "skin" / "serial_port.py")}


@pytest.mark.parametrize("folder", FOLDERS)
def test_arrows_run_one_way(folder: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in (ROOT / folder).rglob("*.py")
        for name, line, _ in imports(path)
        if name.split(".")[0] == "coneskin" and (name.split(".") + [""])[1] not in MAY_IMPORT[folder]
    ]
    assert wrong == []


@pytest.mark.parametrize("package", HOMES)
def test_a_heavy_dependency_has_one_home(package: str) -> None:
    allowed = {path for pattern in HOMES[package] for path in ROOT.glob(pattern)}
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources()
        for name, line, _ in imports(path)
        if name.split(".")[0] == package and path not in allowed
    ]
    assert wrong == []


@pytest.mark.parametrize("package", sorted(HOMES.keys() - {"scipy"}))
def test_a_heavy_dependency_is_imported_inside_the_function_that_needs_it(package: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sources()
        for name, line, top in imports(path)
        if name.split(".")[0] == package and top
    ]
    assert wrong == []


@pytest.mark.parametrize("name", [f"{folder}/{word}.py" for folder, words in HOT.items() for word in words.split()])
def test_the_live_path_knows_no_arrays(name: str) -> None:
    found = {imported.split(".")[0] for imported, _, _ in imports(ROOT / name)}
    assert not found & {"numpy", "scipy", "trimesh", "matplotlib"}


@each_source
def test_a_module_says_what_it_is(path: Path) -> None:
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert docstring
    assert docstring.splitlines()[0].rstrip().endswith((".", ":", "?", ";", ",", ")")) or len(docstring) > 100


@each_source
def test_all_is_complete_and_true(path: Path) -> None:
    """``__all__`` names what the module itself defines without an underscore, and nothing else."""
    if path.name in ("__init__.py", "__main__.py"):
        return
    tree = ast.parse(path.read_text(encoding="utf-8"))
    listed: set[str] | None = None
    defined: set[str] = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            defined.add(node.name)
        elif isinstance(node, ast.Assign):
            names = {target.id for target in node.targets if isinstance(target, ast.Name)}
            if "__all__" in names:
                listed = set(ast.literal_eval(node.value))
            defined |= names
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            defined.add(node.target.id)
    assert listed is not None, "no __all__"
    imported = {name.rpartition(".")[2] for name, _, top in imports(path) if top}
    assert listed <= defined | imported, "names that do not exist here"
    public = {name for name in defined - listed if not name.startswith("_")}
    outside = {f"{name_of(path)}.{name}" for name in public} & _used_outside(name_of(path).rpartition(".")[0])
    assert not outside


@cache
def _used_outside(package: str) -> frozenset[str]:
    """What modules of other packages import; neighbours in a package may share more than it offers."""
    others = [path for path in sources() if name_of(path).rpartition(".")[0] != package]
    return frozenset(name for path in others for name, _, _ in imports(path))


@each_source
def test_a_module_imports_cleanly_and_its_names_are_there(path: Path) -> None:
    if path.name == "__main__.py":
        return
    module = importlib.import_module(name_of(path))
    assert all(hasattr(module, name) for name in getattr(module, "__all__", ()))


def test_the_packages_of_the_project_file_are_the_folders() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    folders = {
        path.parent.relative_to(ROOT).as_posix()
        for top in ("src", *FOLDERS)
        for path in (ROOT / top).rglob("__init__.py")
        if not any(parent.is_symlink() for parent in path.parents)
    }
    assert set(project["package-dir"].values()) == folders
    assert set(project["packages"]) == set(project["package-dir"])
    for name, folder in project["package-dir"].items():
        assert name.split(".")[-1] == folder.split("/")[-1]
        assert (ROOT / folder / "py.typed").is_file(), f"{folder} has no py.typed"
    for folder in FOLDERS:
        assert (ROOT / "src" / "coneskin" / folder).resolve() == ROOT / folder


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_folder_refuses_to_be_imported_by_its_bare_name(folder: str) -> None:
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import {folder}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert f"import coneskin.{folder}" in done.stderr


def tracked() -> list[Path]:
    """Every text file of the repository."""
    try:
        listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("this is no git checkout, so nobody knows which files belong to the project")
    return [path for name in listing.split("\0") if name and (path := ROOT / name).is_file() and not path.is_symlink()]


def test_no_file_names_a_workplace_or_an_index() -> None:
    """Paths of somebody's machine and addresses of package indexes are nothing to a reader elsewhere."""
    words = [r"(?<![\w.])/wor" + r"k/", r"/home/\w+/", r"/Users/\w+/", r"/root/", r"extra-index-url", r"index-url\s*="]
    words += [r"--trusted-host", r"/simple/", r"artifactory", r"\.internal\b", r"devpi"]
    wrong = []
    for path in tracked():
        if path == Path(__file__):
            continue
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            continue
        wrong += [
            f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
            for number, line in enumerate(lines, 1)
            if re.search("|".join(words), line)
        ]
    assert wrong == []
