#!/usr/bin/env python3
"""Writes the docstrings of the native module into its stubs, python/surefoot/_native.pyi; with --check only compares.

To be run with a Python that has the wheel. Types are in the stubs already, written by hand; a name without any is told.
"""

import ast
import inspect
import pathlib
import sys

from surefoot import _native

STUBS = pathlib.Path(__file__).resolve().parents[1] / "surefoot/_native.pyi"
# What only builds for tests have.
NOT_SHIPPED = {"provoke_defect"}


def documented(text: str) -> str:
    """The stubs with the docstrings of the module that is installed."""
    tree = ast.parse(text)
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            own = getattr(_native, node.name)
            place(node, own.__doc__)
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and not member.name.startswith("__"):
                    place(member, getattr(own, member.name).__doc__)
        elif isinstance(node, ast.FunctionDef):
            place(node, getattr(_native, node.name).__doc__)
    head = text[: text.index("\nfrom ")]
    return head.rstrip() + "\n\n" + ast.unparse(tree) + "\n"


def place(node: ast.ClassDef | ast.FunctionDef, text: str | None) -> None:
    """Puts a docstring in the place of what is there."""
    body = [own for own in node.body if not (isinstance(own, ast.Expr) and isinstance(own.value, ast.Constant))]
    if text:
        indent = "        " if isinstance(node, ast.FunctionDef) and is_method(node) else "    "
        own = inspect.cleandoc(text).replace("\n", "\n" + indent).replace(indent + "\n", "\n")
        body.insert(0, ast.Expr(ast.Constant(own if "\n" not in own else own + "\n" + indent)))
    node.body = body or [ast.Expr(ast.Constant(...))]


def is_method(node: ast.FunctionDef) -> bool:
    return node.col_offset > 0


def without_stub(text: str) -> list[str]:
    """Names of the module that the stubs do not have."""
    known = {node.name for node in ast.parse(text).body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    names = {name for name in dir(_native) if not name.startswith("__")}
    return sorted(names - known - NOT_SHIPPED)


def main() -> int:
    text = STUBS.read_text()
    if missing := without_stub(text):
        print(f"{STUBS}: expected a stub of every name, found none of {', '.join(missing)}", file=sys.stderr)
        return 1
    written = documented(text)
    if "--check" not in sys.argv[1:]:
        STUBS.write_text(written)
    elif written != text:
        print(f"{STUBS}: expected the module's own docstrings, found others; run python/stubs/write_docstrings.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
