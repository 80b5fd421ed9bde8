"""What the package defines, somebody reads."""

from __future__ import annotations

import ast
from pathlib import Path

TESTS = Path(__file__).resolve().parent
PACKAGE = TESTS.parent / "mrctl"
BY_NAME = {"__all__", "EFFECT"}  # read by Python, and by the registry


def defined(tree):
    """The names that a module assigns at its top level."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        for target in filter(None, targets):
            yield from (one.id for one in ast.walk(target) if isinstance(one, ast.Name))


def read(tree):
    """All names that a module reads, imports, or looks up in something."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
            yield node.id if isinstance(node, ast.Name) else node.attr
        elif isinstance(node, ast.ImportFrom):
            yield from (one.name for one in node.names)


def test_no_constant_is_read_by_nobody():
    trees = {
        file: ast.parse(file.read_text("utf-8")) for top in (PACKAGE, TESTS) for file in top.rglob("*.py")
    }
    known = BY_NAME.union(*map(read, trees.values()))
    unread = {
        (file.relative_to(PACKAGE).as_posix(), name)
        for file, tree in trees.items()
        if file.is_relative_to(PACKAGE)
        for name in set(defined(tree)) - known
    }
    assert not unread
