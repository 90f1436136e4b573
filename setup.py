"""List of the packages: those in src/coneskin, and geometry, skin and robot through the links that stand there.

With ``"" = "src"`` an editable install is one plain path, which type checkers and editors follow. A git without
symbolic links (Windows) writes the links as small files. The three folders at the root are then named one by one, which
works as well, but hides an editable install from type checkers.

With ``CONESKIN_COMPILE=1`` in the environment, mypyc compiles the modules of ``COMPILED``. Everything else, and every
other build, is pure Python. ``CONESKIN_OPTIMIZE`` is the C compiler's level, 3 where it is not set.
"""

import os
import shutil
import sys
from pathlib import Path

from setuptools import find_packages, setup

ROOT = Path(__file__).parent
#: modules of the live path, of replays, and of the field's single scenes, by the library that they become; each library
#: is one run of the C compiler
COMPILED = {
    "core": ("core/version", "core/channel", "core/recording/block"),
    "skin": ("skin/*", "skin/sources/serial_port", "skin/detection/*", "skin/detection/*/*", "skin/field/one_scene"),
    "robot": ("robot/driver/*", "robot/stop/*", "robot/guard/*", "robot/guard/*/*", "robot/ur/*"),
    "motion": ("robot/arm/*", "robot/reaction/*"),
}
#: What is slow there, 60 to 300 ns each where all else takes 2 to 15: a tuple taken apart together with another one, a
#: part of a tuple, x**2 of floats, min and max of more than two, and to make a NamedTuple but by tuple.__new__.
#: the rest of core/recording stays Python: compiled, it decodes chunks no faster (76 ms for a run of 60 s, 69 as it is,
#: 45 of them zlib's), and a compiled generator that is dropped half-way runs no ``finally``, so files stay open
#: what stays Python there: an enumeration with a __new__, protocols, a keyword of C as a name, subclasses of tuples
UNFIT = {"journal", "deadman", "protocol", "events"}
#: ... and what no touch waits for: preparation, other processes, ports, arrays
PREPARATION = {"__init__", "calibration", "materials", "self_test", "fault_diagnosis", "inertia"}
PREPARATION |= {"inverse_kinematics"}
PROCESSES = {"backup_stop", "guard_watchdog", "driver", "driver_process", "examination", "input_writers"}
PROCESSES |= {"model_check", "program_io", "rtde_connection", "stop_sockets", "tcp", "ur_rtde"}
PURE = UNFIT | PREPARATION | PROCESSES

packages, package_dir = find_packages(str(ROOT / "src")), {"": "src"}
linked = True
for folder in ("geometry", "skin", "robot"):
    if not (ROOT / "src" / "coneskin" / folder).is_dir():
        linked = False
        name = f"coneskin.{folder}"
        packages += [name, *(f"{name}.{inner}" for inner in find_packages(str(ROOT / folder)))]
        package_dir[name] = folder


def extensions() -> list:
    """Translate the modules to C."""
    from mypyc.build import mypycify

    if not linked:
        sys.exit("src/coneskin lacks its links, as in a git without them: compile from the source distribution")
    groups = []
    for name, patterns in COMPILED.items():
        files = [path for pattern in patterns for path in Path("src/coneskin").glob(f"{pattern}.py")]
        groups.append((sorted(str(path) for path in files if path.stem not in PURE), f"coneskin_{name}"))
    shutil.rmtree("build/c", ignore_errors=True)  # mypy's cache of other modules would be taken for these
    level = os.environ.get("CONESKIN_OPTIMIZE", "3")
    paths = [path for files, _ in groups for path in files]
    # that file skips the packages of others, whose types are not asked here: the same C in a third of the time
    words = [
        "--config-file=pyproject.toml",
        "--ignore-missing-imports",
        "--follow-imports=silent",
        "--cache-dir=build/c/mypy",
    ]
    return mypycify([*words, *paths], separate=groups, opt_level=level, debug_level="0", target_dir="build/c")


compiling = os.environ.get("CONESKIN_COMPILE") == "1"
setup(
    packages=packages,
    package_dir=package_dir,
    ext_modules=extensions() if compiling and {"build", "build_ext", "bdist_wheel"} & set(sys.argv) else [],
    setup_requires=["mypy>=1.18"] if compiling else [],
    options={"build_ext": {"parallel": os.cpu_count()}},
)
