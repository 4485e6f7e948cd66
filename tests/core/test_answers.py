"""Answers of what all rooms share, as they are stored: errors, checks of values, angles, words and plain results."""

import errno
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, tried
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core import compiled, conventions, errors, plain_math, tables, validation
from exo_pin.core.errors.base import echo, shown

JOINTS = ("one", "two", "three", "four", "five")
Q = np.array([0.1, 0.2])
MADE = {
    "ExoPinError": lambda e: [e("plain", 3)],
    "BrowserNotFound": lambda e: [e(["a", "b"], "BROWSER")],
    "BrowserFailed": lambda e: [e("chromium", "it ended")],
    "SolverFailed": lambda e: [e("trf", 0.00123456), e("trf", 2, "why")],
    "LoopNotClosed": lambda e: [
        e(Q, 0.0199, 7),
        e(Q, 0.0201, 7),
        e(Q, 1.0, 0),
        e(Q, 0.3, 5, "the wrist"),
        *(e(Q, 1e-15, 7, reached=share) for share in (0.0, 0.0345)),
    ],
    "BeyondLimits": lambda e: [e(Q, JOINTS)],
    "UndeterminedMotion": lambda e: [e(Q, 1, JOINTS[:4]), e(Q, 2, JOINTS)],
    "SingularConfiguration": lambda e: [e(Q, Q, 0.12345)],
    "NearSingularConfiguration": lambda e: [e(Q, 1.2345e-9, 2.345e-8)],
    "SamplesFailed": lambda e: [e({k: ValueError(f"no {k}") for k in range(n)}, 9, None) for n in (3, 4)],
    "UndrivenMotion": lambda e: [e(Q, np.array([1.0, -3.14159]), JOINTS)],
    "InfeasibleForces": lambda e: [e(1.23456, JOINTS[:2])],
    "MasslessMotion": lambda e: [e(JOINTS), e(JOINTS[:1], JOINTS[1:3])],
    "MotionBlocked": lambda e: [e(JOINTS)],
    "SimulationStopped": lambda e: [e(1.23456789, Q, Q, "it fell")],
    "UnsupportedDynamics": lambda e: [e("rubbing", JOINTS, "take it out")],
    "UnknownName": lambda e: [
        e("law", "bset", ["best", "a"]),
        e("law", 3, [], "the file"),
        e("law", "x" * 101, ["x" * 100]),
    ],
    "MissingData": lambda e: [e(["mass"], "this"), e(["mass", "size"], "this", "own", "state it")],
    "MissingExtra": lambda e: [e("study", "pandas"), e("study", "pandas", "is old")],
    "FileFormatError": lambda e: [e("bad"), e("bad", Path("folder/a.toml"), "part.key")],
    "FileNotWritten": lambda e: (
        [
            e("a.csv", OSError(number, "why"))
            for number in (
                errno.ENOENT,
                errno.ENOSPC,
                errno.EDQUOT,
                errno.EACCES,
                errno.EPERM,
                errno.EROFS,
                errno.EPIPE,
                errno.EIO,
            )
        ]
        + [e("a.csv", OSError("bare"))]
    ),
    "StorageUnusable": lambda e: [
        e(text, "why") for text in ("sqlite:///a.db", "pg://me:secret@host/a", "pg://me@host/a")
    ],
    "InfeasibleBounds": lambda e: [e([0, np.int64(2)])],
    "NotAWrist": lambda e: [e("arm", "it has two joints")],
    "AbsentAttribute": lambda e: [e("geometry"), e("geometry", "use chain")],
    "OutsideValidity": lambda e: [e("law", "why"), e("law", "why", 2, (np.int64(1), 2))],
    "OutsideRangeOfMotion": lambda e: [e("why"), e("why", 3, (1,))],
    "NotIdentifiable": lambda e: [e("why"), e("why", ("K_1",))],
}


def asked_of_errors():
    def told(name, error):
        again = pickle.loads(pickle.dumps(error))
        assert (str(again), type(again)) == (str(error), type(error))
        assert getattr(again, "msg", "") == getattr(error, "msg", "")
        kept = {key: value for key, value in vars(error).items() if key not in ("q", "v")}
        return str(error), {
            key: [str(each) for each in value.items()] if key == "failures" else value for key, value in kept.items()
        }

    bases = {
        name: [base.__name__ for base in getattr(errors, name).__mro__[1:-2]]
        for name in dir(errors)
        if name[0].isupper()
    }
    return {name: [told(name, error) for error in make(getattr(errors, name))] for name, make in MADE.items()} | {
        "bases": bases
    }


class Unprintable:
    """What Python cannot print."""

    def __repr__(self):
        raise ValueError


def asked_of_words():
    long = " ".join(["word"] * 500)
    texts = ["a" * 500, "a" * 501, long[:2000], long[:2001], "a\x07b\nc\u202e", "\x07" * 499, "é " * 3]
    return {
        "shown": [(len(shown(text)), shown(text)[:40], shown(text)[-40:], "cut" in shown(text)) for text in texts],
        "echo": [echo(value) for value in ("a" * 100, 3.0, Unprintable(), np.arange(3))],
    }


#: Unit vectors but for rounding.
NEARLY_ONE = [np.array(own) / np.linalg.norm(own) for own in np.arange(1.0, 31.0).reshape(10, 3) ** 1.5]
INERTIA = np.diag([1.0, 2.0, 2.9])


def asymmetric(size):
    return INERTIA + np.array([[0.0, size, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@dataclass
class Own:
    """A record with fields to be checked."""

    length: Any = 2
    wall: Any = 0.0
    mass: Any = None


def set_own(**fields):
    own = Own(**fields)
    validation.set_positive(own, "length")
    validation.set_positive(own, "wall", zero=True)
    validation.set_positive(own, "mass", optional=True)
    return own.length, own.wall, own.mass, type(own.length).__name__


def asked_of_checks():
    v, turn = validation, Rotation.from_rotvec([[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])
    ragged, masked = [[1], [1, 2]], np.ma.MaskedArray([1.0], mask=[True])
    return {
        "finite": tried(
            lambda x: v.as_finite("x", x, ()), 3, "3", True, None, np.nan, 1e12, 1.1e12, -1.1e12, 10**400, 1j, [1.0]
        ),
        "arrays": tried(
            lambda x: v.as_finite("x", x, (None, 2)),
            [[1, 2]],
            [1, 2],
            [[[1, 2]]],
            [[1, 2, 3]],
            ragged,
            [[1, np.inf]],
            [],
        ),
        "stacks": tried(lambda x: v.as_finite("x", x, (2,), stack=True), [[1, 2]], [1], 1.0, [[[1, 2]]], masked),
        "vectors": tried(lambda x: v.as_finite("x", x, (2, 2)), [1.0], [[1.0, 2.0], [3.0, 4.0]]),
        "frozen": [v.as_finite("x", [1.0], (1,)).flags.writeable, v.frozen(np.zeros(2)).flags.writeable],
        "positive": tried(lambda x: v.as_positive("x", x), 0, -1, 1e-15, 0.9e-15, 1e12, 1.1e12, 3, True, [1.0]),
        "zero": tried(lambda x: v.as_positive("x", x, zero=True), 0, -1e-20, 1e-16, 2.0),
        "count": tried(lambda x: v.as_count("x", x, 2), 1, 2, np.int8(3), 2.0, True, 2**63 - 1, 2**63),
        "few": tried(lambda x: v.as_count("x", x, 2, 4), 1, 4, 5),
        "mode": tried(lambda x: compiled.mode(x).__enter__(), "fast"),
        "rising": tried(lambda x: v.as_rising("x", x), [0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 1.0, 0.5]),
        "unit": tried(
            lambda x: v.as_unit_vector("x", x),
            [0, 0, 0.9e-12],
            [0, 0, 1.1e-12],
            [3.0, 0.0, 4.0],
            [0.0, 1.0 + 2e-15, 0.0],
            [1, 0],
        ),
        "bits": [(v.as_unit_vector("x", own) == own).all() for own in NEARLY_ONE],
        "pair": tried(lambda x: v.as_pair("x", x), 3, 2.5, -1, 0, np.float64(2), True, None, (1, 2), np.nan),
        "choice": tried(lambda x: v.as_choice("side", x, ("left", "right"), "a file"), "left", "lef", 3),
        "mapping": tried(lambda x: v.as_mapping("x", x, "names to numbers"), None, {"a": 1}, [1]),
        "texts": tried(lambda x: v.as_texts("x", x), ("a",), ["a"], (1,), ()),
        "parts": tried(lambda x: v.as_parts("x", x, ep.Limb), "ab", b"ab", 3, [1], ()),
        "rotation": tried(
            lambda x: v.as_rotation("x", x).as_quat(), turn, [1.0], Rotation.from_rotvec([np.nan, 0.0, 0.0])
        ),
        "single": tried(lambda x: v.as_single_rotation("x", x).as_quat(), turn, turn[0]),
        "method": tried(lambda x: v.require_method("x", x, "append", "a list"), [], ()),
        "type": tried(lambda x: v.require_type("x", x, int | None), 3, None, "a"),
        "an_error": tried(lambda x: v.require_type("x", x, errors.InvalidInput), 3),
        "expected": tried(lambda x: v.require_type("x", x, int, "a number of limbs"), 3, "a"),
        "types": tried(lambda kind: v.require_types(Own(), length=kind, mass=kind | None), int, float),
        "broadcast": in_turn(
            fits=lambda: v.broadcast(a=[[1.0], [2.0]], b=[3, 4]),
            not_=lambda: v.broadcast(a=[1.0, 2.0], b=[1.0, 2.0, 3.0]),
            infinite=lambda: v.broadcast(a=[np.inf]),
            real=lambda: v.broadcast_real(a=[np.inf], b=1.0),
            to=lambda: v.broadcast_to("x", np.ones(2), (3, 2)).shape,
            not_to=lambda: v.broadcast_to("x", np.ones(2), (3,)),
        ),
        "inertia": tried(
            lambda x: v.as_inertia("x", x),
            INERTIA,
            np.zeros((3, 3)),
            np.diag([1.0, 2.0, 3.1]),
            np.diag([-1.0, 2.0, 2.0]),
        ),
        "asymmetric": tried(lambda x: v.as_inertia("x", asymmetric(x)), 2.8e-6, 3.0e-6),
        "tolerant": tried(lambda x: v.as_inertia("x", asymmetric(x), 0.1), 0.28, 0.3),
        "triangle": tried(lambda x: v.as_inertia("x", np.diag([1.0, 2.0, 3.0 + x])), 2.9e-9, 3.1e-9),
        "below_zero": tried(lambda x: v.as_inertia("x", np.diag([2.0, 2.0, -x])), 1.9e-9, 2.1e-9),
        "own": tried(
            lambda x: set_own(**x),
            {},
            {"length": 0.0},
            {"wall": -1},
            {"mass": 0},
            {"mass": 2, "wall": 1},
            {"length": None},
        ),
    }


def asked_of_angles():
    angles = ([10.0, -40.0, 120.0], [25.0, 70.0, -15.0], [-30.0, 5.0, 60.0])
    c = conventions

    def both(make, read):
        poses = {side: make(*angles, side, degrees=True) for side in ("left", "right")}
        return {
            side: (pose.as_matrix()[0], read(pose, side, degrees=True), read(pose, c.other_side(side)))
            for side, pose in poses.items()
        }

    locked = [c.isb_rotation(30.0, elevation, 20.0, degrees=True) for elevation in (0.0, 180.0, 5e-8, 6.3e-8)]
    return {
        "clinical": both(c.shoulder_rotation, c.shoulder_angles),
        "isb": both(c.isb_rotation, c.isb_angles),
        "thesis": (
            c.thesis_rotation(*angles, degrees=True).as_matrix()[0],
            c.thesis_angles(c.thesis_rotation(0.1, 0.2, 0.3)),
        ),
        "degrees": (
            c.thesis_angles(c.thesis_rotation(0.1, 0.2, 0.3), degrees=True),
            c.shoulder_rotation(0.1, 0.2, 0.3).as_quat(),
        ),
        "locked": [c.isb_angles(pose, side, degrees=True) for pose in locked for side in ("left", "right")],
        "zero": str(c.shoulder_angles(Rotation.identity()).tolist()),
        "gimbal": c.shoulder_angles(c.shoulder_rotation(10, 90, 20, degrees=True), degrees=True),
        "columns": c.pose_columns(c.shoulder_rotation(*angles, degrees=True), "right"),
        "shape": c.pose_columns(c.shoulder_rotation(1, 2, 3, degrees=True), "left", (2,)),
        "mirrored": c.mirrored(c.shoulder_rotation(*angles, degrees=True)).as_matrix()[1],
        "along_stack": c.along_arm(np.ones((1, 2, 3)), np.arange(18.0).reshape(1, 2, 3, 3)),
        "along": c.along_arm(np.array([[1.0, 2.0, 3.0]]), c.thesis_rotation(*angles, degrees=True).as_matrix()[:1]),
        "mirrors": (c.GRAVITY, c.MIRROR, c.WRENCH_MIRROR.diagonal()),
        "sides": tried(lambda side: (c.as_side(side), c.other_side(side)), "left", "right", "both", None),
        "other": tried(
            lambda given: c.refuse_other_side(given, "left"), {}, {"side": "left"}, {"side": "right"}, {"side": "x"}
        ),
        "shapes": in_turn(
            wrong=lambda: c.shoulder_rotation([1, 2], [1, 2, 3], 0),
            none=lambda: c.shoulder_angles(3),
            side=lambda: c.shoulder_rotation(1, 2, 3, "both"),
        ),
    }


ROWS = [["name", "F (N)", "x"], ["limb 1", "12.5", "0"], ["<b>", "3", "-10"]]


def asked_of_lines():
    t = tables
    long = "word " * 30
    return {
        "html": [
            t.html_table(ROWS[0], ROWS[1:], ["a & b"], ["below"]),
            t.html_table(["", ""], [["a ", "b"]], numbers=False),
        ],
        "aligned": [t.aligned(ROWS), t.aligned(ROWS, 1), t.aligned(ROWS, 3)],
        "digits": [
            t.three_digits(x) for x in (0.0, 4.9e-7, 5.1e-7, 0.0123456, -0.99999, 1.2345, 99.996, 123.456, 98765.4)
        ],
        "newtons": [t.newtons(x) for x in (0.0, 1.0, -0.04, 0.06, 9.94, 9.96, -10.6, 1234.5)],
        # Numbers that are equal may be written otherwise.
        "zeros": [len(text) for text in (t.newtons(0.0), t.newtons(-0.04), t.three_digits(4e-7), t.three_digits(2.0))],
        "efforts": [t.effort_column(name, unit) for name, unit in (("limb 1", "N"), ("my joint", "N m"))],
        "positions": [
            t.position_column(*each)
            for each in (("limb 2", "N"), ("elbow", "N m"), ("a slide", "N"), ("my limb 3", "N"))
        ],
        "screen": (t.screen_width(200), t.screen_width(40)),
        "blocks": [
            t.in_blocks(ROWS, width, repeated) for width, repeated in ((30, 1), (13, 1), (12, 1), (17, 2), (1, 1))
        ],
        "filled": [t.filled(long), t.indented(long), t.under_verdict("", ["x", ""]), t.under_verdict("Held.", [long])],
        "words": [t.enumerated(words) for words in ([], ["a"], ["a", "b"], ["a", "b", "c"])],
        "limbs": [t.limb_list(numbers) for numbers in ([], [3], [1, 2], [1, 2, 4])],
        "drives": [
            t.drive_list([("limb 1", "N"), ("limb 2", "N"), ("elbow", "N m")], rows) for rows in ([0, 1], [0, 2], [2])
        ],
    }


def asked_of_plain_math():
    values = (-2.0, -1.0, -0.3, 0.0, 0.7, 1.0, 1.1, np.inf, -np.inf, np.nan)
    single = {
        name: [str(round(float(getattr(plain_math, name)(np.float64(x))), 9)) for x in values]
        for name in ("sqrt", "sin", "cos", "acos", "atan")
    }
    pairs = {
        name: [float(getattr(plain_math, name)(x, y)) for x, y in ((1.0, -2.0), (-0.5, 0.25))]
        for name in ("atan2", "hypot", "copysign")
    }
    numbers = {name: type(getattr(plain_math, name)(0.5)).__name__ for name in single}
    numbers |= {name: type(getattr(plain_math, name)(0.5, 0.2)).__name__ for name in pairs}
    return single | pairs | {"kinds": numbers, "constants": [plain_math.pi, plain_math.inf, plain_math.nan]}


ASKED = {
    "plain_math": asked_of_plain_math,
    "errors": asked_of_errors,
    "words": asked_of_words,
    "checks": asked_of_checks,
    "angles": asked_of_angles,
    "lines": asked_of_lines,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
