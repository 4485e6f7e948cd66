"""Verdicts on limbs in words: one limit after the other of three limbs whose lengths and forces are known."""

import re

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from three_limbs import Wrist
from wrists import random_mechanism

import exo_pin as ep

HOLDS = "The device can hold this pose"
CANNOT = "The device cannot hold this pose: "
ASK = "It is not known whether the device can hold this pose"


@pytest.fixture(scope="module")
def wrist():
    own = Wrist(1)
    assert (own.f > 0.0).any()
    assert (own.f < 0.0).any()
    return own


def size(number):
    return f"{number:.0f}" if number >= 9.5 else f"{number:.2g}"


def verdict(wrist, changes=(), estimated=(), **question):
    """Of a device that touches nothing."""
    return wrist.limited(changes, estimated).reaction(wrist.pose, **question).verdict


def test_a_pose_that_keeps_what_is_known_says_what_is_not(wrist):
    push = int(wrist.f.argmin())
    assert verdict(wrist) == f"{HOLDS}."
    assert verdict(wrist, limits="none") == f'{ASK}: limits were left out (limits="none").'
    two = {0: {"fitting": None}, push: {"fitting": None, "push": None}}
    text = verdict(wrist, two)
    limbs = sorted({1, push + 1})
    named = f"limbs {limbs[0]} and {limbs[1]}" if len(limbs) > 1 else "limb 1"
    assert text.startswith(f"{ASK}; not known: ")
    assert f"end fitting of {named}" in text
    assert f"greatest push of limb {push + 1}" in text
    assert verdict(wrist, estimated=(0, 2)) == f"{HOLDS} if the estimates are right (travel of limbs 1 and 3)."
    unsure = verdict(wrist, {0: {"longest": wrist.lengths[0] - 0.002}}, estimated=(0,))
    assert unsure == (
        "The device probably cannot hold this pose: limb 1 would be 2 mm too long (by an estimate of travel of limb 1)."
    )


@pytest.mark.parametrize("count", [1, 2])
def test_lengths_and_speeds_in_words(wrist, count):
    rows = range(count)
    named = "limb 1 would" if count == 1 else "limbs 1 and 2 would"
    sizes, both = ["4.1", "12"][:count], (0.0041, 0.0123)
    listed = " and ".join(sizes)
    long = {i: {"longest": wrist.lengths[i] - both[i]} for i in rows}
    assert verdict(wrist, long) == f"{CANNOT}{named} be {listed} mm too long."
    short = {i: {"shortest": wrist.lengths[i] + both[i]} for i in rows}
    assert verdict(wrist, short) == f"{CANNOT}{named} be {listed} mm too short."
    motion = ep.Motion([0.9, -0.7, 0.8], np.zeros(3))
    rates = np.abs(wrist.exo.jacobian(wrist.pose) @ motion.angular_velocity)
    slow = {i: {"speed": 0.5 * rates[i]} for i in rows}
    faster = " and ".join(f"{0.5 * rates[i]:.2g}" for i in rows)
    expected = f"{CANNOT}{named} have to be {faster} m/s faster than the actuator can."
    assert verdict(wrist, slow, motion=motion) == expected
    # Both ends of a stroke, each with its limb, in this order.
    mixed = {0: {"longest": wrist.lengths[0] - 0.1}, 1: {"shortest": wrist.lengths[1] + 0.0123}}
    mixed[0]["shortest"] = wrist.lengths[0] - 0.15
    assert verdict(wrist, mixed) == f"{CANNOT}limb 2 would be 12 mm too short; limb 1 would be 100 mm too long."


def test_forces_in_words(wrist):
    for sign, name, words in ((1.0, "pull", "pull"), (-1.0, "push", "push")):
        rows = np.flatnonzero(sign * wrist.f > 0.0)
        for some in (rows[:1], rows):
            limits = {int(i): {name: 0.75 * abs(wrist.f[i])} for i in some}
            numbers = [str(i + 1) for i in some]
            named = f"limb {numbers[0]}" if len(some) == 1 else f"limbs {' and '.join(numbers)}"
            needed = " and ".join(size(abs(wrist.f[i])) for i in some)
            most = " and ".join(size(0.75 * abs(wrist.f[i])) for i in some)
            text = f"{CANNOT}{named} would have to {words} with {needed} N (at most {most} N)."
            assert verdict(wrist, limits) == text
    # Cables cannot push at all, and a least tension that a limb does not reach.
    low = int(wrist.f.argmin())
    need = size(-wrist.f[low])
    assert verdict(wrist, {low: {"push": 0.0}}).startswith(f"{CANNOT}limb {low + 1} would have to push with {need} N.")
    high = int(wrist.f.argmax())
    has, least = size(wrist.f[high]), size(1.5 * wrist.f[high])
    hangs = f"{CANNOT}limb {high + 1} would pull with only {has} N (at least {least} N)."
    assert verdict(wrist, limits=(np.where(np.arange(3) == high, 1.5 * wrist.f[high], -1e5), 1e5)) == hangs
    assert verdict(wrist, limits=(3.0 * wrist.size, 1e5)).endswith(
        "; an actuator cannot take the length of limbs 1, 2 and 3."
    )


def test_a_stack_counts_the_poses_of_each_reason(wrist):
    """Each pose of the stack bears another share of the same load, so that its limb forces are that share."""
    light = wrist.exo.replace(gravity=[0.0, 0.0, 0.0])
    weight = wrist.exo.arm.mass * wrist.exo.mechanism.gravity
    moment = np.cross(wrist.pose.as_matrix() @ wrist.exo.arm.centre_of_mass, weight)

    def count(shares, changes=(), estimated=(), **question):
        limited = wrist.limited(changes, estimated)
        exo = light.replace(limbs=limited.limbs) if not estimated else limited.replace(gravity=[0.0, 0.0, 0.0])
        shares = np.array(shares)
        load = ep.Load(np.outer(shares, weight), np.outer(shares, moment))
        return exo.reaction(Rotation.concatenate([wrist.pose] * len(shares)), load=load, **question).verdict

    assert count([1.0, 0.5]) == "The device can hold 2 of 2 poses."
    none = count([1.0, 0.5], limits="none")
    assert none == 'It is not known which of 2 poses the device can hold: limits were left out (limits="none").'
    high, low = int(wrist.f.argmax()), int(wrist.f.argmin())
    weak, stiff = {high: {"pull": 0.75 * wrist.f[high]}}, {low: {"push": 0.0}}
    assert count([1.0, 0.5, 0.9], weak) == (
        "The device can hold 1 of 3 poses; in the others a limb would have to pull too hard (2)."
    )
    assert count([1.0, 0.5], weak | stiff) == (
        "The device can hold none of 2 poses: a limb would have to push (2), a limb would have to pull too hard (1)."
    )
    ends = {high: {"longest": wrist.lengths[high] - 0.01}, low: {"shortest": wrist.lengths[low] + 0.01}}
    assert (
        count([0.1] * 3, ends)
        == "The device can hold none of 3 poses: a limb would be too short (3), a limb would be too long (3)."
    )
    assert count([1.0, -1.0], {high: {"pull": None}}) == (
        "The device can hold 1 of 2 poses, and 1 more if the unknown limits allow it."
    )
    assert (
        count([1.0, 1.0], {high: {"pull": None}}) == "The device can hold 2 of 2 poses if the unknown limits allow it."
    )
    assert count([1.0, 1.0], estimated=(0,)) == "The device can hold 2 of 2 poses if the estimates are right."


def singular_pose(seed):
    """A random wrist and its first singular pose about a random axis."""
    exo = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(seed), 3))
    axis = np.random.default_rng(seed).normal(size=3)

    def determinant(angle):
        return float(exo.singularity(Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))).determinant)

    angles = np.linspace(0.0, 3.0, 61)
    first = int(np.flatnonzero(np.diff(np.sign([determinant(angle) for angle in angles])))[0])
    angle = brentq(determinant, *angles[first : first + 2], xtol=1e-16, rtol=1e-15)
    return exo, Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))


def test_a_singular_pose_names_the_axis_that_nothing_holds():
    prototype = ep.load("prototype")
    lifted = prototype, prototype.pose(abduction=90)
    for exo, pose in (lifted, *(singular_pose(seed) for seed in (1, 2, 3))):
        answer = exo.reaction(pose, limits="none")
        assert answer.equilibrium_status == "singular"
        words = f"{CANNOT}it is singular, and the limbs cannot resist a moment about "
        assert answer.verdict.startswith(words)
        axis = np.array(re.search(r"\((-?\d.\d\d), (-?\d.\d\d), (-?\d.\d\d)\)", answer.verdict).groups(), dtype=float)
        # No tension gives a moment about that axis.
        on_arm = pose.as_matrix() @ np.array(exo.geometry.platform_points).T
        lines = on_arm.T - exo.geometry.base_points
        arms = np.cross(on_arm.T, lines / np.linalg.norm(lines, axis=1)[:, None])
        np.testing.assert_allclose(arms @ axis, 0.0, atol=0.01 * np.abs(arms).max())
        # It is named after the nearest of the three axes, in whose direction it points.
        nearest = int(np.abs(axis).argmax())
        assert axis[nearest] > 0.0
        name = ("forward", "sideways", "vertical")[nearest]
        angle = np.degrees(np.arccos(min(1.0, axis[nearest] / np.linalg.norm(axis))))
        told = re.search(r"an axis (\d+)° from the (\w+) axis", answer.verdict)
        if told is None:
            assert f"about the {name} axis" in answer.verdict
            assert angle < 1.6
        else:
            assert told.group(2) == name
            assert float(told.group(1)) == pytest.approx(angle, abs=1.1)
    stack = prototype.reaction(prototype.pose(abduction=[90.0, 90.0]))
    assert stack.verdict == "The device can hold none of 2 poses: the pose is singular (2)."
