"""Descriptions of fields for the site: what stands behind ``#:`` on a field's line (called by mkdocs, mkdocs.yml)."""

import re
from typing import Any

import griffe

_FIELD = re.compile(r"\S.*  #: (.+)")


class FieldComments(griffe.Extension):
    """Take the comment of a field of a class for its docstring, where it has no other."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **_: Any) -> None:
        if attr.docstring is None and attr.lineno is not None and attr.parent is not None and attr.parent.is_class:
            line = attr.lines_collection[attr.filepath][attr.lineno - 1]
            if match := _FIELD.search(line):
                attr.docstring = griffe.Docstring(match[1], lineno=attr.lineno, parent=attr)
