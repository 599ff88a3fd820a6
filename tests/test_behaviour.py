"""Tests name behaviour: what reads or replaces a private name of something else says why, beside it or above."""

import ast
import re
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILES = [path for folder in ("tests", "scripts", "gallery") for path in sorted((ROOT / folder).rglob("*.py"))]
# Public all the same: Python's own, and what a named tuple has.
PUBLIC = {"_exit", "_getframe", "_current_frames", "_asdict", "_fields", "_replace"}


def is_private(name: str) -> bool:
    return re.match("_[A-Za-z]", name) is not None and name not in PUBLIC


def private_names(tree):
    """(line, name) of what is read or replaced: attributes of anything but `self`, `cls` and super(); what is imported;
    strings behind an object, as getattr, setattr and mock.patch take them; and the path that mock.patch takes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            if is_private(node.attr) and ast.unparse(node.value) not in ("self", "cls", "super()"):
                yield node.end_lineno, node.attr
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.Call | ast.Tuple):
            given = node.args if isinstance(node, ast.Call) else node.elts
            for before, each in zip((None, *given), given, strict=False):
                if isinstance(each, ast.Constant) and isinstance(each.value, str):
                    if isinstance(before, ast.Name | ast.Attribute | ast.Call):
                        yield each.lineno, each.value
                    elif before is None and re.fullmatch(r"\w+(\.\w+)+", each.value):
                        yield each.lineno, each.value.rpartition(".")[2]


def own_names(tree) -> set[str]:
    """What the file itself defines or sets, also of its own classes."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and is_private(node.attr):
            names.update({node.attr} if ast.unparse(node.value) == "self" else ())
    return names


def explained(path) -> set[int]:
    """The lines that have a comment, and those below a comment that has a line of its own."""
    lines = set()
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            if token.type == tokenize.COMMENT and not re.match("# *(noqa|type:|ruff:)", token.string):
                row, column = token.start
                lines.add(row if token.line[:column].strip() else row + 1)
    return lines


def unexplained(path) -> list[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = [(line, name) for line, name in private_names(tree) if is_private(name)]
    own, lines = (own_names(tree), explained(path)) if found else ((), ())
    return [f"line {line}: {name}" for line, name in found if name not in own and line not in lines]


def test_what_reads_a_private_name_says_why():
    assert {path.relative_to(ROOT): found for path in FILES if (found := unexplained(path))} == {}
