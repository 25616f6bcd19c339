# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Check that files, functions and packages stay small enough to be read."""

import ast
import io
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

SOURCES = Path(__file__).resolve().parents[1] / "ros2_ws/src"
FILE_LINES = 450
FUNCTION_LINES = 60
CORE = "gait_entrainment"
CORE_LINES = 6_500
ALL_LINES = 36_496

Function = ast.FunctionDef | ast.AsyncFunctionDef
NO_CODE = {
    tokenize.COMMENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
    tokenize.INDENT,
    tokenize.NEWLINE,
    tokenize.NL,
}


def modules() -> list[str]:
    """Return the tracked and new Python files outside tests, relative to the sources."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", "*.py"],
        cwd=SOURCES,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\0")
    return [name for name in listed if "/test/" not in name and (SOURCES / name).is_file()]


def docstrings(tree: ast.AST) -> set[int]:
    """Return the lines of docstrings."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, Function | ast.ClassDef) and ast.get_docstring(node) is not None:
            lines.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return lines


def long_functions(text: str) -> Iterator[tuple[int, str, int]]:
    """Yield line, name and lines of code in the body of each function that has too many."""
    tree = ast.parse(text)
    code = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in NO_CODE
        for line in range(token.start[0], token.end[0] + 1)
    } - docstrings(tree)
    for node in ast.walk(tree):
        if isinstance(node, Function):
            body = range(node.body[0].lineno, (node.end_lineno or 0) + 1)
            if (count := len(code.intersection(body))) > FUNCTION_LINES:
                yield node.lineno, node.name, count


def main() -> int:
    """Print what is too long, one line each; return the exit code."""
    found, totals = [], Counter[str]()
    for name in modules():
        text = (SOURCES / name).read_text(encoding="utf-8")
        lines = text.count("\n")
        totals[name.partition("/")[0]] += lines
        if lines > FILE_LINES:
            found.append(f"{name}: {lines} lines, at most {FILE_LINES}")
        found += [
            f"{name}:{line}: {function} has {count} lines of code, at most {FUNCTION_LINES}"
            for line, function, count in long_functions(text)
        ]
    if totals[CORE] > CORE_LINES:
        found.append(f"{CORE}: {totals[CORE]} lines, at most {CORE_LINES}")
    if totals.total() > ALL_LINES:
        found.append(f"all packages: {totals.total()} lines, at most {ALL_LINES}")
    for message in found:
        print(message)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
