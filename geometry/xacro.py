"""Expansion of a xacro file to the URDF that it describes. The only importer of xacrodoc.

A xacro file is a program: it names further files, and its expressions are evaluated. Expand only what you trust.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from coneskin.core.errors import MeshError, MissingExtra

__all__ = ["expand_xacro"]


def expand_xacro(
    path: str | Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, str | Path] | None = None,
) -> bytes:
    """Return the URDF that a xacro file describes, in UTF-8; paths of meshes beside it become absolute.

    Args:
        path: the xacro file.
        arguments: values of its ``<xacro:arg>``, as ``name:=value`` of the ROS program.
        packages: folders of the ROS packages that ``$(find ...)`` names; others are searched for above the file.

    Raises:
        MeshError: the file cannot be read, or xacro cannot expand it; the message has xacro's words.
        MissingExtra: xacrodoc is not installed.
    """
    path = Path(path)
    try:
        from xacrodoc import XacroDoc
        from xacrodoc import packages as finder
    except ImportError as exc:
        raise MissingExtra("xacrodoc", f"expanding {path.name}", "xacro") from exc
    try:
        # what was found for another file must not be taken for this one
        finder.reset()
        finder.update_package_cache(dict(packages or {}))
        document = XacroDoc.from_file(path, subargs=dict(arguments or {}), resolve_packages=False)
        return str(document.to_urdf_string(pretty=False)).encode()
    except OSError as exc:
        raise MeshError(f"{path}: {exc.strerror or exc}") from exc
    except Exception as exc:  # xacro raises errors of many types, from its own to those of the expressions
        reason = " ".join(str(exc).split()) or type(exc).__name__
        advice = "name its folder (--package NAME=DIR, packages={...})" if "ackage not found" in reason else ""
        if "ndefined substitution argument" in reason:
            advice = "name its value (--xacro-arg NAME=VALUE, arguments={...})"
        raise MeshError(f"{path}: xacro cannot expand it: {reason}{': ' if advice else ''}{advice}") from exc
