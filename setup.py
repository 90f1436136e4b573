"""List of the packages: those in src/coneskin, and geometry, skin and robot through the links that stand there.

With ``"" = "src"`` an editable install is one plain path, which type checkers and editors follow. A git without
symbolic links (Windows) writes the links as small files. The three folders at the root are then named one by one, which
works as well, but hides an editable install from type checkers.
"""

from pathlib import Path

from setuptools import find_packages, setup

ROOT = Path(__file__).parent
packages, package_dir = find_packages(str(ROOT / "src")), {"": "src"}
for folder in ("geometry", "skin", "robot"):
    if not (ROOT / "src" / "coneskin" / folder).is_dir():
        name = f"coneskin.{folder}"
        packages += [name, *(f"{name}.{inner}" for inner in find_packages(str(ROOT / folder)))]
        package_dir[name] = folder
setup(packages=packages, package_dir=package_dir)
