"""Whether the tests of a room notice a wrong sign, bound or number in it: mutants by room, killed or alive.

    python benchmarks/mutants.py numerics wrist --count 20    a seeded sample of each room
    python benchmarks/mutants.py --all                        every mutant of every room: days

A mutant is one small change of one module: another comparison, sign, operator, number, truth value or function. It is
never written to a file: the tests run in a process of their own, in which the module is loaded with the change. Kernels
run without compilation, and a room is judged by its own tests alone, those of the full run among them with ``--full``.
A mutant that takes ten times as long as the tests without it, and at least a minute, counts as killed.
"""

from __future__ import annotations

import argparse
import ast
import importlib.machinery
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
#: Rooms in which a silent change gives a wrong number.
ROOMS = ("numerics", "wrist", "wrist_chain", "reaction", "chain", "person", "workspace", "muscle/laws", "load_case")
#: Name of the variable of the environment that says which module is changed, and where.
CHOSEN = "EXO_PIN_MUTANT"
#: No test may take longer than this, s, however quick the tests are without the change.
_LEAST_LIMIT = 60.0

_COMPARISONS = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}
_COMPARISONS |= {ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
_OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.BitAnd: ast.BitOr}
_OPERATORS |= {ast.BitOr: ast.BitAnd}
_SWAPS = {"any": "all", "min": "max", "minimum": "maximum", "argmin": "argmax", "sin": "cos", "zeros": "ones"}
_SWAPS |= {new: old for old, new in _SWAPS.items()}


class Mutant(NamedTuple):
    """One change: of the ``number``-th place of a module that can be changed."""

    path: Path
    number: int
    line: int
    change: str

    @property
    def module(self) -> str:
        """Dotted name."""
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


class _Places(ast.NodeTransformer):
    """Goes through a module and changes the ``chosen`` place, or none; lists all of them."""

    def __init__(self, chosen: int = -1) -> None:
        self.chosen, self.found = chosen, list[tuple[int, str]]()

    def _place(self, node: ast.AST, change: str) -> bool:
        self.found.append((node.lineno, change))  # type: ignore[attr-defined]
        return len(self.found) - 1 == self.chosen

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        # Neither annotations nor decorators nor the docstring: they compute nothing.
        body = node.body[1:] if ast.get_docstring(node) is not None else node.body
        node.args.defaults = [self.visit(default) for default in node.args.defaults]
        node.body = node.body[: len(node.body) - len(body)] + [self.visit(statement) for statement in body]
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.value = self.visit(node.value) if node.value is not None else None
        return node

    def visit_If(self, node: ast.If) -> ast.AST:
        if "TYPE_CHECKING" in ast.unparse(node.test):
            return node
        if self._place(node, f"if {ast.unparse(node.test):.60}  ->  if not ..."):
            node.test = ast.UnaryOp(ast.Not(), node.test)
            return node
        return self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        return node  # a message; its condition is what counts

    visit_Assert = visit_JoinedStr = visit_Import = visit_ImportFrom = visit_Raise  # type: ignore[assignment]

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        for index, operation in enumerate(node.ops):
            other = _COMPARISONS[type(operation)]
            if self._place(node, f"{ast.unparse(node):.60}  ->  {other.__name__}"):
                node.ops[index] = other()
        return self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        other = _OPERATORS.get(type(node.op))
        if other is not None and self._place(node, f"{ast.unparse(node):.60}  ->  {other.__name__}"):
            node.op = other()
        return self.generic_visit(node)

    visit_AugAssign = visit_BinOp  # type: ignore[assignment]

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        if self._place(node, f"{ast.unparse(node):.60}  ->  without {type(node.op).__name__}"):
            return node.operand
        return self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        if self._place(node, f"{ast.unparse(node):.60}  ->  {other.__name__}"):
            node.op = other()
        return self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if isinstance(node.value, bool):
            changed: object = not node.value
        elif isinstance(node.value, int):
            changed = node.value + 1
        elif isinstance(node.value, float):
            changed = 1.5 * node.value or 1.0
        else:
            return node
        return (
            ast.copy_location(ast.Constant(changed), node)
            if self._place(node, f"{node.value}  ->  {changed}")
            else node
        )

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        other = _SWAPS.get(node.attr)
        if other is not None and self._place(node, f"{ast.unparse(node):.60}  ->  {other}"):
            node.attr = other
        return self.generic_visit(node)


def mutants(room: str) -> list[Mutant]:
    """All mutants of a room of the package, such as "numerics" or "chain/kinematics"."""
    found = []
    for path in sorted((ROOT / "exo_pin" / room).rglob("*.py")):
        places = _Places()
        places.visit(ast.parse(path.read_text(encoding="utf-8")))
        found += [Mutant(path, number, line, change) for number, (line, change) in enumerate(places.found)]
    return found


def tests_of(path: Path) -> Path:
    """The folder of tests of a module: that of its own name, or the nearest above it."""
    folder = ROOT / "tests" / path.parent.relative_to(ROOT / "exo_pin")
    while not any(folder.glob("test_*.py")) and folder.parent != ROOT / "tests":
        folder = folder.parent
    return folder


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads the chosen module with its change; nothing of it is cached."""

    def get_code(self, fullname: str) -> object:
        tree = ast.parse(self.get_data(self.path))
        changed = _Places(int(os.environ[CHOSEN].partition(":")[2])).visit(tree)
        return compile(ast.fix_missing_locations(changed), self.path, "exec")


class _Finder:
    """Stands before Python's own finders."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> object:
        if name != os.environ[CHOSEN].partition(":")[0]:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)  # type: ignore[arg-type]
        spec.loader = _Loader(name, spec.origin)  # type: ignore[union-attr,arg-type]
        return spec


if CHOSEN in os.environ:  # loaded as a plugin of pytest
    sys.meta_path.insert(0, _Finder())  # type: ignore[arg-type]


def run_tests(folder: Path, mutant: Mutant | None, limit: float | None, full: bool) -> tuple[bool, float]:
    """Whether the tests of a folder pass with a mutant, and how long they took, s."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", str(folder)]
    command += ["-m", ""] if full else []
    paths = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    own = os.environ | {"PYTHONPATH": paths, "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    if mutant is not None:
        command += ["-p", "mutants"]
        own[CHOSEN] = f"{mutant.module}:{mutant.number}"
    begun = time.monotonic()
    try:
        done = subprocess.run(command, cwd=ROOT, env=own, capture_output=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return False, time.monotonic() - begun
    if done.returncode not in (0, 1, 2, 3):
        raise RuntimeError(done.stdout.decode()[-2000:] + done.stderr.decode()[-2000:])
    return done.returncode == 0, time.monotonic() - begun


def judged(room: str, count: int | None, seed: int, full: bool) -> Iterator[tuple[Mutant, bool]]:
    """Mutants of a room, a seeded sample or all, and whether each is alive after the tests."""
    chosen = mutants(room)
    if count is not None:
        chosen = random.Random(f"{room} {seed}").sample(chosen, min(count, len(chosen)))
    limits: dict[Path, float] = {}
    for mutant in chosen:
        folder = tests_of(mutant.path)
        if folder not in limits:
            passes, took = run_tests(folder, None, None, full)
            if not passes:
                raise RuntimeError(f"the tests in {folder.relative_to(ROOT)} fail without a mutant")
            limits[folder] = max(_LEAST_LIMIT, 10.0 * took)
        yield mutant, run_tests(folder, mutant, limits[folder], full)[0]


def main() -> None:
    """Print the mutants that are alive, and the share of the killed ones by room."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", default=ROOMS, help="folders of the package")
    parser.add_argument("--count", type=int, default=20, help="mutants of each room (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--all", action="store_true", help="every mutant")
    parser.add_argument("--full", action="store_true", help="with the tests of the full run")
    options = parser.parse_args()
    rows = []
    for room in options.rooms:
        killed = total = 0
        for mutant, alive in judged(room, None if options.all else options.count, options.seed, options.full):
            total, killed = total + 1, killed + (not alive)
            if alive:
                print(f"alive: {mutant.path.relative_to(ROOT)}:{mutant.line}  {mutant.change}", flush=True)
        rows.append(f"| {room} | {killed} of {total} | {100.0 * killed / max(1, total):.0f} % |")
        print(rows[-1], flush=True)
    print("\n| room | killed | share |\n| --- | --- | --- |", *rows, sep="\n")


if __name__ == "__main__":
    main()
