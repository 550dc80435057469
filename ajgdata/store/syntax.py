"""Syntax trees of Python files without the parts that cannot change a result."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

from ajgdata.store.files import read_text


@functools.cache
def deciding_tree(file: Path) -> ast.Module:
    """Return the syntax tree of a file without the parts that cannot change a result."""
    tree = ast.parse(read_text(file))
    return _Deciding().visit(tree)


class _Deciding(ast.NodeTransformer):
    """Removes docstrings, messages of errors, descriptions of settings, and imports for types."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        """Remove a docstring."""
        is_text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return ast.Pass() if is_text else self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        """Remove the message of an error; its code, a text without spaces, remains."""
        if isinstance(node.exc, ast.Call):
            node.exc.args = [value for value in node.exc.args if not _is_message(value)]
        return self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> ast.AST | None:
        """Remove the description of a setting."""
        return None if node.arg == "description" else self.generic_visit(node)

    def visit_If(self, node: ast.If) -> ast.AST | None:
        """Remove imports that only type checkers see."""
        is_typing = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return None if is_typing else self.generic_visit(node)


def _is_message(value: ast.expr) -> bool:
    """Return whether an argument is a text for people: it has a space."""
    parts = value.values if isinstance(value, ast.JoinedStr) else [value]
    texts = [part.value for part in parts if isinstance(part, ast.Constant)]
    return any(isinstance(text, str) and " " in text for text in texts)


def used_statements(tree: ast.Module, names: tuple[str, ...]) -> list[ast.stmt]:
    """Return the definitions of `names` in a module, with the definitions and imports that they
    use there, in the order of the module.

    A statement without definitions is included if it uses one of the used names, because it can
    change the value.

    >>> tree = ast.parse("import math\\nA = 1\\ndef f(): return g(A)\\ndef g(x): return x")
    >>> [ast.unparse(statement) for statement in used_statements(tree, ("f",))]
    ['A = 1', 'def f():\\n    return g(A)', 'def g(x):\\n    return x']
    """
    defined = [(statement, defined_names(statement)) for statement in tree.body]
    waiting = set(names)
    used = {"*"}
    while waiting:
        name = waiting.pop()
        used.add(name)
        for statement, own in defined:
            if name in (own or _used_names(statement)):
                waiting |= _used_names(statement) - used
    statements: list[ast.stmt] = []
    for statement, own in defined:
        if isinstance(statement, (ast.Import, ast.ImportFrom)):
            aliases = [alias for alias in statement.names if _bound_name(alias) in used]
            statements += _imports(statement, aliases)
        elif (own or _used_names(statement)) & used:
            statements.append(statement)
    return statements


def _imports(
    statement: ast.Import | ast.ImportFrom, aliases: list[ast.alias]
) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yield an import of each of `aliases`, so that their order does not count."""
    for alias in sorted(aliases, key=lambda alias: alias.name):
        if isinstance(statement, ast.Import):
            yield ast.Import(names=[alias])
        else:
            yield ast.ImportFrom(module=statement.module, names=[alias], level=statement.level)


def defined_names(statement: ast.stmt) -> set[str]:
    """Return the names that a statement of a module defines."""
    if isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        return {statement.name}
    if isinstance(statement, (ast.Import, ast.ImportFrom)):
        return {_bound_name(alias) for alias in statement.names}
    stored = (node for node in ast.walk(statement) if isinstance(node, ast.Name))
    return {node.id for node in stored if isinstance(node.ctx, ast.Store)}


def _used_names(statement: ast.stmt) -> set[str]:
    """Return the names that a statement reads."""
    return {node.id for node in ast.walk(statement) if isinstance(node, ast.Name)}


def _bound_name(alias: ast.alias) -> str:
    """Return the name that an import binds."""
    return alias.asname or alias.name.partition(".")[0]
