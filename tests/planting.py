"""Errors that can be planted in a source file, one at a time: places in its syntax tree, and the text with the error.

Text, imports, annotations, decorators, messages of exceptions and calls that build them are left alone. An error is put
in by replacing the text of one expression.
"""

import ast
import copy
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

KINDS = ("operator", "sign", "index", "swapped arguments", "constant", "dropped term", "condition")

_OTHER = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult},
    **{ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE},
    **{ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is},
    **{ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And},
}
#: functions of whose first two arguments the order does not matter, or an exchange is an error of types at once
_EVEN = {"min", "max", "maximum", "minimum", "add", "multiply", "hypot", "logaddexp", "isinstance", "issubclass", "zip"}
_EVEN |= {"getattr", "hasattr", "fmin", "fmax", "logical_and", "logical_or", "outer", "vdot", "allclose", "isclose"}
#: arguments that are exchanged only with others like them: an exchange with a number is an error of types at once
_SORTS = (ast.Lambda, ast.Compare, ast.Dict, ast.DictComp, ast.GeneratorExp)
#: calls that only word an error
_WORDS = {"Fault", "InputError", "TypeError", "ValueError", "RuntimeError", "warn", "TypeVar", "NewType", "cast"}


class Site(NamedTuple):
    """One possible error: `before` → `after` in `function` (its qualified name, empty at the level of the module)."""

    module: str
    function: str
    line: int
    kind: str
    before: str
    after: str
    start: int  # place of the text replaced
    end: int

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What marks the site in the list of equivalent ones: it holds after lines have moved."""
        return self.module, self.function, self.before, self.after


def _name(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _is_text(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_text(node.left) or _is_text(node.right)
    return isinstance(node, ast.JoinedStr | ast.List | ast.Tuple | ast.ListComp) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
    )


def _expressions(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Expressions that compute, each with the qualified name of its function."""

    def walk(node: ast.AST, name: str, inner: str) -> Iterator[tuple[str, ast.expr]]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = f"{inner}{node.name}"
            inner = f"{name}." if isinstance(node, ast.ClassDef) else f"{name}.<locals>."
            parts = [*node.body]
            if not isinstance(node, ast.ClassDef):
                parts += [x for x in (*node.args.defaults, *node.args.kw_defaults) if x is not None]
            for part in parts:
                yield from walk(part, name, inner)
            return
        if isinstance(node, ast.Raise | ast.Assert | ast.Import | ast.ImportFrom):
            return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return  # a docstring
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Call) and _name(node) in _WORDS:
            return
        if isinstance(node, ast.expr):
            yield name, node
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns"):
                continue
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, ast.AST):
                    yield from walk(part, name, inner)

    yield from walk(tree, "", "")


def _constant(value: object) -> ast.expr:
    return ast.Constant(value)


def _number(node: ast.AST) -> int | None:
    """The whole number that an index is, as in `x[-1]`."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
        value = node.operand.value
        return -value if type(value) is int else None
    return node.value if isinstance(node, ast.Constant) and type(node.value) is int else None


def _whole(value: int) -> ast.expr:
    return _constant(value) if value >= 0 else ast.UnaryOp(ast.USub(), _constant(-value))


def _errors(node: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """Kinds of error at an expression, and what stands there instead."""
    if isinstance(node, ast.BinOp) and not _is_text(node):
        if type(node.op) in _OTHER:
            yield "operator", ast.BinOp(node.left, _OTHER[type(node.op)](), node.right)
        if isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div):
            yield "dropped term", node.left
        if isinstance(node.op, ast.Add | ast.Mult):
            yield "dropped term", node.right
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _OTHER:
        yield "operator", ast.Compare(node.left, [_OTHER[type(node.ops[0])]()], node.comparators)
    elif isinstance(node, ast.BoolOp):
        yield "operator", ast.BoolOp(_OTHER[type(node.op)](), node.values)
        for i in range(len(node.values)):
            rest = node.values[:i] + node.values[i + 1 :]
            yield "dropped term", rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        if not isinstance(node.operand, ast.Constant):
            yield "sign", node.operand
    elif isinstance(node, ast.IfExp):
        yield "condition", ast.IfExp(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)
    elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
        place = _number(node.slice)
        if place is not None:
            yield "index", ast.Subscript(node.value, _whole(0 if place == -1 else place + 1), node.ctx)
        elif isinstance(node.slice, ast.Slice):
            for bound in ("lower", "upper"):
                place = _number(getattr(node.slice, bound) or ast.Pass())
                if place is not None:
                    other = copy.copy(node.slice)
                    setattr(other, bound, _whole(place + (1 if place >= 0 else -1)))
                    yield "index", ast.Subscript(node.value, other, node.ctx)
    elif isinstance(node, ast.Call):
        plain = [not isinstance(a, ast.Starred) for a in node.args]
        for i in range(len(node.args) - 1):
            even = i == 0 and _name(node) in _EVEN
            pair = node.args[i : i + 2]
            sorts = {type(a) if isinstance(a, _SORTS) or _is_text(a) else ast.expr for a in pair}
            idle = len(sorts) > 1 or ast.dump(pair[0]) == ast.dump(pair[1])
            if plain[i] and plain[i + 1] and not even and not idle:
                args = [*node.args]
                args[i], args[i + 1] = args[i + 1], args[i]
                yield "swapped arguments", ast.Call(node.func, args, node.keywords)
    elif isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool):
            yield "constant", _constant(not value)
        elif isinstance(value, int):
            yield "constant", _constant(value + 1)
        elif isinstance(value, float) and math.isfinite(value):
            yield "constant", _constant(float(f"{1.1 * value:.4g}") if value else 1.0)


def sites(module: Path, root: Path) -> list[Site]:
    """All errors that can be planted in a file, in the order of the text."""
    text = module.read_text("utf-8")
    tree, starts = ast.parse(text), [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    name, found = module.relative_to(root).as_posix(), []
    indices = {id(part) for node in ast.walk(tree) if isinstance(node, ast.Subscript) for part in ast.walk(node.slice)}
    for function, node in _expressions(tree):
        if isinstance(node, ast.Constant) and id(node) in indices:
            continue  # an error of its subscript
        start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        for kind, other in _errors(node):
            before, after = ast.unparse(node), ast.unparse(other)
            found.append(Site(name, function, node.lineno, kind, before, after, start, end))
    return found


def with_error(text: str, site: Site) -> str | None:
    """The text with the error in it; `None` where that would not be the tree that was meant, as in some f-strings."""
    whole = text.encode()
    there = whole[site.start : site.end].decode(errors="replace")
    try:
        if ast.dump(ast.parse(f"({there})", mode="eval")) != ast.dump(ast.parse(f"({site.before})", mode="eval")):
            return None
        found = (whole[: site.start] + f"({site.after})".encode() + whole[site.end :]).decode()
        return found if ast.dump(ast.parse(found)) != ast.dump(ast.parse(text)) else None
    except SyntaxError:
        return None
