"""Pages of the site with another source: one for each folder, the options of the commands, CONTRIBUTING, CHANGELOG.

A hook of mkdocs (mkdocs.yml). The module names come from the disk, so a new module is on its folder's page at once.
"""

import importlib
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
from reference import design_tables, method_table, option_tables

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "coneskin"
#: page -> file at the root
COPIED = {"contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}


def on_config(config: Any) -> Any:
    """Add the folders of code to the navigation (called by mkdocs)."""
    config["nav"].append({"API by folder": [{folder: f"api/{folder}.md"} for folder in folders(PACKAGE)]})
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the pages (called by mkdocs)."""
    for name, text in generated_pages():
        files.append(File.generated(config, name, content=text))
    return files


def generated_pages() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each page."""
    for page, source in COPIED.items():
        text = (ROOT / source).read_text(encoding="utf-8").replace("](docs/", "](")
        for other, name in COPIED.items():
            text = text.replace(f"]({name})", f"]({other})")
        yield page, text
    yield "look-up/design-options.md", f"# Options of a design\n\n{design_tables()}"
    yield "look-up/options.md", f"# Options of the commands\n\n{option_tables()}"
    yield "look-up/ur-rtde.md", f"# Methods of ur_rtde on `session.arm`\n\n{methods()}"
    for folder in folders(PACKAGE):
        yield f"api/{folder}.md", folder_page(folder)


def folders(path: Path, prefix: str = "") -> Iterator[str]:
    """Yield the folders of the package that hold modules, by their import names without ``coneskin.``."""
    if not prefix:
        yield "coneskin"
    for inner in sorted(path.iterdir()):
        if (inner / "__init__.py").is_file():
            if modules(inner):
                yield f"{prefix}{inner.name}"
            yield from folders(inner, f"{prefix}{inner.name}.")


def modules(path: Path) -> list[str]:
    """Return the names of the modules in a folder."""
    return sorted(file.stem for file in path.glob("*.py") if not file.stem.startswith("__"))


def methods() -> str:
    """Return the table of ur_rtde's methods, where its wheel is installed."""
    try:
        return method_table()
    except ImportError:
        return "The site was built without ur_rtde: `python scripts/reference.py --show methods` prints the table.\n"


def folder_page(folder: str) -> str:
    """Return the page of one folder: its modules, each by its docstrings."""
    package = "coneskin" if folder == "coneskin" else f"coneskin.{folder}"
    path = PACKAGE if folder == "coneskin" else PACKAGE.joinpath(*folder.split("."))
    opening = inspect.getdoc(importlib.import_module(package)) or ""
    lines = [f"# `{package}`", "", opening.split("\n\n")[0], ""]
    for name in modules(path):
        lines += [f"::: {package}.{name}", ""]
    return "\n".join(lines)
