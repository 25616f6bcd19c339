# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Write HTML pages of the public names: make_api_pages.py [FOLDER].

pdoc writes them, with two additions: the comment after a field, which gives its unit, becomes the
field's text (for a setting: its meaning and what is allowed), and pages end with an example.
"""

import dataclasses
import importlib
import inspect
import io
import sys
import tokenize
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import pdoc
from pdoc import doc_ast

ROOT = Path(__file__).resolve().parents[1]
PUBLIC = (
    "gait_entrainment.simulation",
    "gait_entrainment.run",
    "gait_entrainment_commands.outcome",
    "gait_entrainment.protocol",
    "gait_entrainment.parameters",
    "gait_entrainment.gait",
    "gait_entrainment.robot",
    "gait_entrainment.conventions",
    "gait_entrainment.errors",
    "gait_entrainment_bags",
)
EXAMPLES = {
    "gait_entrainment.simulation": "simulate_a_protocol.py",
    "gait_entrainment.robot": "ankle_robot_driver.py",
    "gait_entrainment_bags": "strides_of_a_bag.py",
}
read_tree = doc_ast.walk_tree


def offered(module: ModuleType) -> list[str]:
    """Return the public names of a package: those that its __init__.py defines or imports."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and not inspect.ismodule(value)
    ]


def field_comments(source: str) -> dict[str, str]:
    """Return the comment after each `name: type` or `name = value` that has one."""
    comments, name = {}, ""
    for token, following in pairwise(tokenize.generate_tokens(io.StringIO(source).readline)):
        if token.type == tokenize.NAME and following.string in (":", "=") and not name:
            name = token.string
        elif token.type == tokenize.COMMENT and name:
            comments[name] = token.string.lstrip("# ")
        elif token.type == tokenize.NEWLINE:
            name = ""
    return comments


def read_tree_with_comments(thing: Any) -> doc_ast.AstInfo:
    """Return what pdoc reads from the source of a module or class, with its fields' comments."""
    found = read_tree(thing)
    texts = field_comments(doc_ast.get_source(thing))
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            if setting := field.metadata.get("setting"):
                texts[field.name] = f"{setting.meaning}; {setting.allowed}"
    for name in texts.keys() & found.annotations.keys():
        found.var_docstrings.setdefault(name, texts[name])
    return found


def main(folder: Path = ROOT / "docs/api") -> None:
    """Write the pages."""
    for name in PUBLIC:
        module = importlib.import_module(name)
        if hasattr(module, "__path__"):
            module.__all__ = getattr(module, "__all__", offered(module))
        if name in EXAMPLES:
            program = (ROOT / "docs/examples" / EXAMPLES[name]).read_text(encoding="utf-8")
            program = program.partition("\n\n")[2]  # without the licence
            module.__doc__ = f"{module.__doc__}\n### Example\n\n```python\n{program}```\n"
    doc_ast.walk_tree = read_tree_with_comments
    pdoc.render.configure(docformat="numpy", footer_text="gait_entrainment", logo=None)
    pdoc.pdoc(*PUBLIC, output_directory=folder)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
