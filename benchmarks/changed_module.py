"""Changes one module as it is loaded, and runs the tests of such a change in a process of their own."""

from __future__ import annotations

import ast
import importlib.machinery
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from mutant_places import ROOT, Mutant, Places, parsed

#: Name of the variable of the environment that says which module is changed, and where.
CHOSEN = "EXO_PIN_MUTANT"


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads the chosen module with its change; nothing of it is cached."""

    def get_code(self, fullname: str) -> object:
        changed = Places(int(os.environ[CHOSEN].partition(":")[2])).visit(parsed(Path(self.path)))
        return compile(ast.fix_missing_locations(changed), self.path, "exec", dont_inherit=True)


class _Finder:
    """Stands before Python's own finders."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> object:
        if name != os.environ[CHOSEN].partition(":")[0]:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)  # type: ignore[arg-type]
        spec.loader = _Loader(name, spec.origin)  # type: ignore[union-attr,arg-type]
        return spec


if CHOSEN in os.environ:
    sys.meta_path.insert(0, _Finder())  # type: ignore[arg-type]


def passes_reloaded(mutant: Mutant, items: list[Any], limit: float) -> bool:
    """Whether tests pass with a module that is changed as it is loaded."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-m", ""]
    paths = os.pathsep.join([str(Path(sys.modules["exo_pin"].__path__[0]).parent), str(Path(__file__).parent)])
    own = os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", CHOSEN: f"{mutant.module}:{mutant.number}"}
    command += [item.nodeid for item in items]
    try:
        done = subprocess.run(command, cwd=ROOT, env=own, capture_output=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0
