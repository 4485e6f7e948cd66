"""Kernels: plain and compiled forms agree, one is chosen by counts, and the cache notices every edit."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from kernel_calls import all_kernels, changed, recorded_calls

from exo_pin.core import compiled
from exo_pin.core.compiled import PLAIN_WORK, Kernel, kernel, mode, one_search

KERNELS = all_kernels()
JIT_IS_OFF = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
needs_jit = pytest.mark.skipif(JIT_IS_OFF, reason="with NUMBA_DISABLE_JIT there is no compiled form")
#: One can be called from compiled code only, the others return memory that is not filled.
NOT_COMPARED = {
    "numerics.vectors.root",
    "numerics.bounded.box_descent.scratch",
    "chain.kinematics.kernels.closure_kernels.new_scratch",
    "chain.derivatives.change_kernels.new_change_memory",
    "chain.dynamics.equations.motion_kernels.new_room",
    "device.turns.turn_rates.new_room",
    "chain.dynamics.equations.solution_kernels.new_memory",
    "numerics.rank_factors._new_room",
}
#: Rooms of the main line, from a pose to the force on the shoulder: their kernels are compared by default, private ones
#: and all others in the full set.
MAIN_LINE = ("core.", "numerics.", "load_case.", "wrist.limbs.", "wrist.forces.", "reaction.")
COMPARED = [
    pytest.param(name, marks=[] if name.startswith(MAIN_LINE) and "._" not in name else pytest.mark.full)
    for name in sorted(set(KERNELS) - NOT_COMPARED)
]
#: Orthonormal bases have free signs, so products with themselves are compared.
BASES = {"chain.dynamics.equations.solution_kernels.solutions"}


@kernel
def quotient(x, y):
    return x / y


@kernel
def shifted(x):
    return quotient(x, 2.0) + 1.0


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    return recorded_calls(tmp_path_factory.mktemp("calls"))


def numbers(value):
    """All numbers of a result, in one array."""
    if isinstance(value, tuple):
        return np.concatenate([numbers(part) for part in value]) if value else np.empty(0)
    return np.empty(0) if value is None else np.asarray(value, dtype=float).ravel()


def result(each, form, arguments):
    """What a form returns and writes, as numbers; the type of the error if it raises one."""
    own = changed(arguments, lambda array: array)
    try:
        with np.errstate(all="ignore"):
            answer = form(*own)
    except (np.linalg.LinAlgError, ValueError):  # ValueError: NaN as an integer
        return None
    if each in BASES:
        answer = (*answer[:1], answer[1] @ answer[1].T, *answer[2:])
    return numbers((answer, own))


def zero(array):
    array[...] = 0.0
    return array


def not_a_number(array):
    array[...] = np.nan
    return array


def rounded(array):
    """The nearest numbers above and below, in turn."""
    up = np.arange(array.size).reshape(array.shape) % 2 == 0
    with np.errstate(all="ignore"):
        array[...] = np.nextafter(array, np.where(up, np.inf, -np.inf))
    return array


CHANGES = {"as recorded": lambda array: array, "zero": zero, "NaN": not_a_number}


@pytest.mark.full
@needs_jit
@pytest.mark.parametrize("name", COMPARED)
def test_plain_and_compiled_forms_agree(name, calls):
    each = KERNELS[name]
    assert each in calls, "add a query that uses this kernel to tests/oracles/kernel_calls.py"
    compare(name, calls[each])


def compare(name, recorded):
    each = KERNELS[name]
    for arguments in recorded:
        for change in CHANGES.values():
            given = changed(arguments, change)
            plain, machine = result(name, each.plain, given), result(name, each.compiled, given)
            if plain is None or machine is None:
                # LAPACK's and Numba's checks differ on what is not finite.
                assert plain is machine or change in (not_a_number, zero)
                continue
            near = result(name, each.plain, changed(given, rounded))
            with np.errstate(all="ignore"):
                moved = 0.0 if near is None else np.abs(plain - near)
                # Larger numbers are those of scratch arrays that are not filled.
                size = np.abs(plain[np.abs(plain) < 1e9]).max(initial=1e-300)
                agree = (plain == machine) | (np.isnan(plain) & np.isnan(machine))
                agree |= np.abs(plain - machine) <= 1e-14 * size + 100.0 * np.nan_to_num(moved, nan=np.inf)
            assert agree.all(), f"{plain[~agree]} plain, {machine[~agree]} compiled"


@pytest.mark.parametrize("name", compiled.MODES)
def test_division_by_zero_is_infinite_in_every_mode(name):
    with mode(name):
        assert quotient(1.0, 0.0) == np.inf
        assert np.isnan(quotient(0.0, 0.0))
        assert type(shifted(3.0)) is float
        assert shifted(3.0) == 2.5


@needs_jit
def test_auto_compiles_after_a_count_of_work():
    @kernel
    def double(x):
        return 2.0 * x

    @kernel(stack=True)
    def total(rows):
        return rows.sum()

    with mode("auto"):
        for _ in range(PLAIN_WORK):
            double(1.0)
        assert not double.is_ready
        assert double(1.0) == 2.0
        assert double.is_ready
        total(np.ones(PLAIN_WORK))
        assert not total.is_ready
        total(np.ones(1))
        assert total.is_ready
    with mode("plain"):
        assert double(1.0) == 2.0


def test_a_stamp_is_of_all_that_a_kernel_is_made_of():
    def made(text="return SCALE * half(x) + len(PAIR)", half="return 0.5 * x", scale=2.0, pair=(1.0, 2.0), **options):
        scope = {"SCALE": scale, "PAIR": pair, "math": math}
        exec(f"def half(x):\n    {half}\ndef whole(x):\n    {text}", scope)
        scope["half"] = Kernel(scope["half"])
        return Kernel(scope["whole"], **options)

    changed = [
        made(), made(half="return 0.25 * x"), made(half="return 0.5 / x"), made(scale=3.0), made(pair=(1.0, 3.0)),
        made("return SCALE * half(x) - len(PAIR)"), made("return SCALE * half(x) + max(PAIR)"),
        made("return math.sin(x)"), made("return math.cos(x)"), made("return sum(k for k in x)"),
        made("return sum(k + 1 for k in x)"), made(fills=True), made(inline=True),
    ]  # fmt: skip
    assert len({each.stamp for each in changed}) == len(changed)
    assert made().stamp == changed[0].stamp
    one = made()
    before = one.stamp
    one._function.__globals__["SCALE"] = 5.0
    assert one.stamp == before
    one.forget()
    assert one.stamp != before


@needs_jit
def test_one_search_compiles_only_what_is_dear():
    @kernel
    def cheap(x):
        return x + 1.0

    @kernel(cost=PLAIN_WORK)
    def dear(x):
        return x - 1.0

    with mode("auto"):
        with one_search():
            for _ in range(PLAIN_WORK + 1):
                assert cheap(1.0) == 2.0
            assert [dear(1.0), dear(1.0)] == [0.0, 0.0]
        assert not cheap.is_ready
        assert dear.is_ready
        for _ in range(PLAIN_WORK + 1):
            cheap(1.0)
        assert cheap.is_ready


def python(text, folder=None, **environment):
    """Standard output and standard error of a program in a process of its own."""
    clean = {key: value for key, value in os.environ.items() if key not in ("EXO_PIN_COMPILE", "NUMBA_DISABLE_JIT")}
    path = os.pathsep.join(part for part in (str(folder or ""), *sys.path) if part)
    done = subprocess.run(
        [sys.executable, "-c", text],
        env={**clean, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout, done.stderr


INNER = "from exo_pin.core.compiled import kernel\nSCALE = {scale}\n@kernel\ndef inner(x):\n    return {sign}x\n"
OUTER = (
    "from exo_pin.core.compiled import kernel\nfrom inner import SCALE, inner\n"
    "@kernel\ndef outer(x):\n    return SCALE * inner(x)\n"
)
CALL = "from outer import outer\nfrom exo_pin.core.compiled import compilations\nprint(outer(1.0), compilations())"


@pytest.mark.full
def test_cache_is_read_by_a_second_process_and_notices_edits_in_other_files(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)

    def run(scale, sign):
        (tmp_path / "inner.py").write_text(INNER.format(scale=scale, sign=sign))
        cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
        return python(CALL, tmp_path, EXO_PIN_COMPILE="compiled", **cache)[0].split()

    assert run("2.0", "+") == ["2.0", "2"]
    assert run("2.0", "+") == ["2.0", "0"]
    assert run("3.0", "+") == ["3.0", "2"]
    assert run("3.0", "-") == ["-3.0", "2"]


@pytest.mark.full
def test_compilation_is_announced_once_and_reading_the_cache_is_not(tmp_path):
    (tmp_path / "one.py").write_text(INNER.format(scale=1, sign="+"))
    text = "from one import inner\nfor _ in range(400): inner(1.0)\nfor x in range(400): inner(x)"
    first = python(text, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))[1]
    assert first.count("compiling, once") == 1
    assert python(text, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))[1] == ""


@pytest.mark.full
def test_the_search_for_a_pose_that_can_be_held_compiles_nothing(tmp_path):
    text = "from exo_pin.cli import main\nmain(['reaction', 'prototype', '--flexion', '40'])\n"
    printed, said = python(text, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert "No pose within 60° can be held." in printed
    assert said == ""


FIRST = (
    "import sys, exo_pin as ep\n"
    "print(ep.load('prototype').reaction(ep.shoulder_rotation(60, 0, 0, degrees=True)).shoulder_force)\n"
)
HEAVY = ("numba", "scipy.stats", "scipy.optimize", "scipy.integrate", "matplotlib", "meshcat", "proxsuite", "pandas")


def test_a_first_reaction_imports_neither_numba_nor_other_heavy_packages():
    out, error = python(FIRST + f"print(*[name for name in {HEAVY} if name in sys.modules])")
    assert out.splitlines()[1:] == [""]
    assert error == ""


def test_help_and_version_import_no_numpy():
    text = (
        "import sys\nfrom exo_pin.cli import main\n"
        "try:\n    main(['{}'])\nfinally:\n    assert 'numpy' not in sys.modules"
    )
    for option in ("--help", "--version"):
        python(text.format(option))


@pytest.mark.full
def test_package_runs_without_jit(capsys):
    exec(FIRST)
    expected = capsys.readouterr().out
    out, _ = python(FIRST + "assert 'numba' not in sys.modules", NUMBA_DISABLE_JIT="1", EXO_PIN_COMPILE="compiled")
    assert out == expected
