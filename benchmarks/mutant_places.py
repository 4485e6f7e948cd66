"""Small changes of a module, one at a time, and functions that run them in place of what was loaded."""

# ruff: noqa: D102 - what Python or pytest calls by these names, they describe

from __future__ import annotations

import ast
import gc
import hashlib
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
#: Name, among the built-in ones, of the function that notes which statements of traced modules have run.
NOTE = "_exo_pin_note_statement"

_REVERSED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
_REVERSED |= {ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
_SHIFTED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
_OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.BitAnd: ast.BitOr}
_OPERATORS |= {ast.BitOr: ast.BitAnd}
_SWAPS = {"any": "all", "min": "max", "minimum": "maximum", "argmin": "argmax", "sin": "cos", "zeros": "ones"}
_SWAPS |= {new: old for old, new in _SWAPS.items()}
#: Calls that mostly change the type of what they are given, or say something: without them nothing is wrong.
_CONVERT = {"float", "int", "str", "bool", "tuple", "list", "set", "dict", "frozenset", "len", "range", "iter", "next"}
_CONVERT |= {
    "repr",
    "print",
    "type",
    "super",
    "asarray",
    "array",
    "ascontiguousarray",
    "copy",
    "items",
    "keys",
    "values",
}
_CONVERT |= {"warn", "cast", "from_iterable"}
#: Whole numbers from here on are counts of steps or sizes, which one more would hardly change: they become 1.
_MANY = 10


class Place(NamedTuple):
    """Where a change stands in the syntax tree: no local name and no line, so that edits elsewhere leave it as it is.

    ``function`` is the qualified name, empty for the module itself; ``kind`` the class of the node; ``change`` what
    becomes of it, as "Mult -> Div"; ``nth`` counts the same changes of the same kind in the function, from 0.
    """

    function: str
    kind: str
    change: str
    nth: int


class Found(NamedTuple):
    """A place that can be changed: its line, the change in words, the line of its statement, and its address.

    ``statement`` is the line of the statement in a function that runs it, 0 for what runs when the module is loaded.
    """

    line: int
    change: str
    statement: int
    place: Place


class Mutant(NamedTuple):
    """One change: of the ``number``-th place of a module that can be changed."""

    path: Path
    number: int
    line: int
    change: str
    statement: int
    place: Place

    @property
    def module(self) -> str:
        """Dotted name."""
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def __str__(self) -> str:
        return f"{self.path.relative_to(ROOT)}:{self.line}  {self.change}"


class Places(ast.NodeTransformer):
    """Goes through a module and changes the ``chosen`` place, or none; lists all of them."""

    def __init__(self, chosen: int = -1) -> None:
        self.chosen, self.found = chosen, list[Found]()
        self._statement, self._depth = 0, 0
        self._scope: list[str] = []
        self._counts: Counter[tuple[str, str, str]] = Counter()

    def _place(self, node: ast.AST, text: str, old: str, new: str) -> bool:
        same = (".".join(self._scope), type(node).__name__, f"{old} -> {new}")
        place = Place(*same, self._counts[same])
        self._counts[same] += 1
        self.found.append(Found(node.lineno, f"{text:.60}  ->  {new}", self._statement, place))  # type: ignore[attr-defined]
        return len(self.found) - 1 == self.chosen

    def visit(self, node: ast.AST) -> ast.AST:
        """Change a node, its statement known."""
        if not isinstance(node, ast.stmt) or not self._depth:
            return super().visit(node)
        before, self._statement = self._statement, node.lineno
        try:
            return super().visit(node)
        finally:
            self._statement = before

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        # Neither annotations nor decorators nor the docstring: they compute nothing.
        body = _without_docstring(node)
        arguments = node.args
        self._scope.append(node.name)
        arguments.defaults = [self.visit(default) for default in arguments.defaults]
        arguments.kw_defaults = [self.visit(default) if default else None for default in arguments.kw_defaults]
        self._depth += 1
        node.body = node.body[: len(node.body) - len(body)] + [self.visit(statement) for statement in body]
        self._depth -= 1
        self._scope.pop()
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        self._scope.append(node.name)
        node.body = [self.visit(statement) for statement in node.body]
        self._scope.pop()
        return node

    def visit_keyword(self, node: ast.keyword) -> ast.AST:
        # zip's strict guards against faults of the package itself.
        return node if node.arg == "strict" else self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        text, name = ast.unparse(node), ast.unparse(node.func).rpartition(".")[2]
        for keyword in list(node.keywords):
            if keyword.arg in {None, "strict", "stacklevel", "copy", "dtype"}:
                continue
            if self._place(node, text, f"{keyword.arg}=", f"without {keyword.arg}="):
                node.keywords.remove(keyword)
                return node
        alone = len(node.args) == 1 and not node.keywords and not isinstance(node.args[0], ast.Starred)
        # A kind of exception, a record or a conversion made of one thing is no call that could be forgotten.
        forgotten = alone and name[:1].islower() and name not in _CONVERT
        if forgotten and self._place(node, text, "call", "its argument"):
            return node.args[0]
        return self.generic_visit(node)

    def _dropped(self, node: ast.stmt) -> bool:
        return self._depth > 0 and self._place(node, ast.unparse(node), "statement", "dropped")

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        # A docstring is none; a warning or a note says something, like a message.
        says = not isinstance(node.value, ast.Call) or ast.unparse(node.value.func).rpartition(".")[2] in _CONVERT
        return ast.copy_location(ast.Pass(), node) if not says and self._dropped(node) else self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        # A name that is never set fails at once; a field or an element that is not set may pass.
        kept = any(isinstance(target, ast.Name | ast.Tuple) for target in node.targets)
        return ast.copy_location(ast.Pass(), node) if not kept and self._dropped(node) else self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        text = ast.unparse(node)
        if self._place(node, text, "if", "always"):
            return node.body
        return node.orelse if self._place(node, text, "if", "never") else self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.value = self.visit(node.value) if node.value is not None else None
        return node

    def visit_If(self, node: ast.If) -> ast.AST:
        if "TYPE_CHECKING" in ast.unparse(node.test):
            return node
        if self._place(node, f"if {ast.unparse(node.test)}", "if", "if not"):
            node.test = ast.UnaryOp(ast.Not(), node.test)
            return node
        for forced, word in ((True, "always"), (False, "never")):
            if self._place(node, f"if {ast.unparse(node.test)}", "if", word):
                node.test = ast.copy_location(ast.Constant(forced), node.test)
                return node
        return self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        return node  # a message; its condition is what counts

    visit_Assert = visit_JoinedStr = visit_Import = visit_ImportFrom = visit_Raise  # type: ignore[assignment]

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        # On numbers of a continuum a bound that counts, or not, is no difference; on counts it is one.
        counts = any(_is_count(side) for side in (node.left, *node.comparators))
        for index, operation in enumerate(node.ops):
            other = (_SHIFTED if counts and type(operation) in _SHIFTED else _REVERSED)[type(operation)]
            if self._place(node, ast.unparse(node), type(operation).__name__, other.__name__):
                node.ops[index] = other()
        return self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        other = _OPERATORS.get(type(node.op))
        if other is not None and self._place(node, ast.unparse(node), type(node.op).__name__, other.__name__):
            node.op = other()
        return self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        return ast.copy_location(ast.Pass(), node) if self._dropped(node) else self.visit_BinOp(node)  # type: ignore[arg-type]

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        name = type(node.op).__name__
        if self._place(node, ast.unparse(node), name, f"without {name}"):
            return node.operand
        return self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        if self._place(node, ast.unparse(node), type(node.op).__name__, other.__name__):
            node.op = other()
        return self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if isinstance(node.value, bool):
            changed: object = not node.value
        elif isinstance(node.value, int):
            changed = node.value + 1 if node.value < _MANY else 1
        elif isinstance(node.value, float):
            changed = 2.0 * node.value + 1.0
        else:
            return node
        old = str(node.value)
        if isinstance(node.value, float) and node.value and self._place(node, old, old, "times 1.2"):
            return ast.copy_location(ast.Constant(1.2 * node.value), node)
        return ast.copy_location(ast.Constant(changed), node) if self._place(node, old, old, str(changed)) else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        other = _SWAPS.get(node.attr)
        if other is not None and self._place(node, ast.unparse(node), node.attr, other):
            node.attr = other
        return self.generic_visit(node)


def _without_docstring(node: ast.FunctionDef) -> list[ast.stmt]:
    return node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body


def _is_count(node: ast.expr) -> bool:
    """Whether an expression is a count for sure: a whole number but zero, or a length."""
    whole = isinstance(node, ast.Constant) and type(node.value) is int and node.value != 0
    return whole or (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "len")


class Noting(ast.NodeTransformer):
    """Puts a note of its line before each statement of each function."""

    def __init__(self, path: Path) -> None:
        self._path, self._depth = str(path.relative_to(ROOT)), 0

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        self._depth += 1
        body = _without_docstring(node)
        node.body = node.body[: len(node.body) - len(body)] + self._noted(body)
        self._depth -= 1
        return node

    def generic_visit(self, node: ast.AST) -> ast.AST:
        for name, value in ast.iter_fields(node):
            if self._depth and isinstance(value, list) and value and isinstance(value[0], ast.stmt):
                setattr(node, name, self._noted(value))
            elif isinstance(value, list):
                for part in value:
                    if isinstance(part, ast.AST):
                        self.visit(part)
            elif isinstance(value, ast.AST):
                self.visit(value)
        return node

    def _noted(self, body: list[ast.stmt]) -> list[ast.stmt]:
        noted: list[ast.stmt] = []
        for statement in body:
            place = ast.Tuple([ast.Constant(self._path), ast.Constant(statement.lineno)], ast.Load())
            note = ast.Expr(ast.Call(ast.Name(NOTE, ast.Load()), [place], []))
            noted += [ast.fix_missing_locations(ast.copy_location(note, statement)), self.visit(statement)]
        return noted


def path_of(module: str) -> Path:
    """Source file of a module, such as "exo_pin.chain"."""
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def parsed(path: Path) -> ast.Module:
    """The tree of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))


def mutants(room: str) -> list[Mutant]:
    """All mutants of a room of the package, such as "numerics" or "chain/kinematics"."""
    found = []
    for path in sorted((ROOT / "exo_pin" / room).rglob("*.py")):
        places = Places()
        places.visit(parsed(path))
        found += [Mutant(path, number, *place) for number, place in enumerate(places.found)]
    return found


def replace_code(path: Path, tree: ast.Module) -> None:
    """Give all functions that were loaded from a module the code of a changed tree of it."""
    loaded: dict[CodeType, list[FunctionType]] = {}
    # The package may have been loaded from another folder, where it is installed.
    place = str(path)
    if path.is_relative_to(ROOT / "exo_pin"):
        place = str(Path(sys.modules["exo_pin"].__path__[0]) / path.relative_to(ROOT / "exo_pin"))
    for thing in gc.get_objects():
        if type(thing) is FunctionType and thing.__code__.co_filename == place:
            loaded.setdefault(thing.__code__, []).append(thing)
    old = compile(parsed(path), place, "exec", dont_inherit=True)
    new = compile(ast.fix_missing_locations(tree), place, "exec", dont_inherit=True)
    # Of a statement that was dropped, or can no more be reached, the functions inside are gone, too.
    changed = dict(_codes(new))
    for key, before in _codes(old):
        for function in loaded.get(before, ()):
            function.__code__ = changed.get(key, before)


def _codes(code: CodeType) -> Iterator[tuple[tuple[str, int, int], CodeType]]:
    """All functions in a module, each by its qualified name, its line and its number among those of the same line."""
    count = Counter[tuple[str, int]]()
    left = [code]
    while left:
        for constant in left.pop().co_consts:
            if isinstance(constant, CodeType):
                name = (constant.co_qualname, constant.co_firstlineno)
                yield (*name, count[name]), constant
                count[name] += 1
                left.append(constant)


class Unchanged:
    """Guards the sources of the package and its tests, which a long run reads again and again."""

    def __init__(self, root: Path = ROOT) -> None:
        self._root, self._before = root, self._stamps(root)

    def check(self) -> None:
        """Refuse to go on where a file was changed, added or removed: what follows would be judged wrongly."""
        now = self._stamps(self._root)
        changed = sorted(path for path in self._before.keys() | now if self._before.get(path) != now.get(path))
        if changed:
            names = ", ".join(str(path.relative_to(self._root)) for path in changed[:3])
            more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
            raise SystemExit(
                f"sources changed while mutants were judged: {names}{more}; begin again, in a copy of the clone"
            )

    @staticmethod
    def _stamps(root: Path) -> dict[Path, bytes]:
        files = (path for folder in ("exo_pin", "tests") for path in (root / folder).rglob("*.py"))
        return {path: hashlib.blake2b(path.read_bytes(), digest_size=16).digest() for path in files}
