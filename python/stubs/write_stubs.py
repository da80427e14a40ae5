#!/usr/bin/env python3
"""Writes python/surefoot/_native.pyi: what `maturin generate-stubs` found in the native module, in one shape.

    write_stubs.py GENERATED.pyi [--check]

Names, arguments, defaults, types and docstrings are those of the Rust side. Here they get the names that types are written
with there, and lose what no user calls. With --check the file is only compared.
"""

import ast
import pathlib
import sys

STUBS = pathlib.Path(__file__).resolve().parents[1] / "surefoot/_native.pyi"
#: What only builds for tests have, what pickling calls, and a name for all others, which there are not.
LEFT_OUT = {"provoke_defect", "__reduce__", "__getattr__"}
#: What the Rust side's types are written with.
VOCABULARY = '''\
# Generated from the Rust side by python/stubs/write_stubs.py; do not edit.

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Final, SupportsFloat, SupportsIndex, TypeAlias, final
from numpy import bool_, float32, float64, uint8
import numpy as np
import pandas as pd
from _typeshed import DataclassInstance
from numpy.typing import NDArray
_Floats: TypeAlias = Sequence[float] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
_Float32: TypeAlias = NDArray[np.float32]
_Float64: TypeAlias = NDArray[np.float64]
_Uint8: TypeAlias = NDArray[np.uint8]
_Description: TypeAlias = dict[str, Any] | DataclassInstance
_Settings: TypeAlias = Mapping[str, Any] | DataclassInstance | str | PathLike[str]
_Answer: TypeAlias = NDArray[np.floating[Any]]
_Path: TypeAlias = str | PathLike[str]
_Drive: TypeAlias = pd.DataFrame | Mapping[str, Any] | Recording | _Path

class Defect(RuntimeError):
    """Surefoot broke off where it never should: a defect of its own, whatever it was given."""
'''


class Shaped(ast.NodeTransformer):
    """Types out of their quotes, methods without the mark of their object, dicts with the type of their keys."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        arguments = node.args
        if [own.arg for own in arguments.posonlyargs] in (["self"], ["cls"]):
            arguments.args[:0], arguments.posonlyargs = arguments.posonlyargs, []
        for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
            argument.annotation = argument.annotation and unquoted(argument.annotation)
        node.returns = node.returns and unquoted(node.returns)
        node.body = [ast.Expr(ast.Constant(text_of(node)))] if ast.get_docstring(node) else node.body
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        node.body = [own for own in node.body if name_of(own) not in LEFT_OUT]
        if ast.get_docstring(node):
            node.body[0] = ast.Expr(ast.Constant(text_of(node)))
        self.generic_visit(node)
        return node


def text_of(node: ast.FunctionDef | ast.ClassDef) -> str:
    """The docstring as it is written into the file, which indents it no further."""
    text, indent = ast.get_docstring(node) or "", " " * (node.col_offset + 4)
    lines = text.replace("\n", "\n" + indent).replace(indent + "\n", "\n")
    return lines + "\n" + indent if "\n" in text else lines


def unquoted(annotation: ast.expr) -> ast.expr:
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    keyed: ast.expr = Keyed().visit(annotation)
    return keyed


class Keyed(ast.NodeTransformer):
    """Dicts of ours have names for keys."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.Subscript:
        node.slice = self.visit(node.slice)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.parse("dict[str, Any]", mode="eval").body if node.id == "dict" else node


def name_of(node: ast.stmt) -> str:
    return getattr(node, "name", "")


def shaped(generated: str) -> str:
    tree = ast.parse(generated)
    tree.body = [
        node for node in tree.body
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and name_of(node) not in LEFT_OUT
    ]  # fmt: skip
    tree = Shaped().visit(tree)
    return VOCABULARY + "\n" + ast.unparse(tree) + "\n"


def main(generated: str, *options: str) -> int:
    written = shaped(pathlib.Path(generated).read_text())
    if "--check" not in options:
        STUBS.write_text(written)
    elif written != STUBS.read_text():
        print(f"{STUBS}: expected what was generated, found something else; run {__file__} {generated}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
