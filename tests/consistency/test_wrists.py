"""The consistency checks, on designs that pass and on designs made to fail."""

import dataclasses
import types
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from wrists import random_mechanism

import exo_pin as ep
from exo_pin.consistency import CHAIN_CHECKS, WRIST_CHECKS, check
from exo_pin.testing import consistency_checks

test_prototype = consistency_checks("prototype")
test_published_urdf = consistency_checks(str(Path(__file__).parents[2] / "urdf" / "prototype.urdf"))
test_right_prototype = consistency_checks(ep.load("prototype", side="right"))
test_random_design_with_five_limbs = consistency_checks(
    random_mechanism(np.random.default_rng(1), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"])
)


@pytest.mark.parametrize("name", ep.presets())
def test_published_mechanisms_are_consistent(name):
    report = ep.load(name).check()
    assert report.passed, str(report)
    assert {finding.name for finding in report.findings} == {*CHAIN_CHECKS, *WRIST_CHECKS}


def outcome(report, name):
    return next(finding for finding in report.findings if finding.name == name)


@pytest.mark.parametrize(
    ("name", "method", "spoil"),
    [
        ("loops", "residual", lambda value: value + 1e-9),
        ("closure Jacobian", "constraint_jacobian", lambda value: value * (1 + 1e-6)),
        ("closure Jacobian", "constraint_jacobian", lambda value: value * np.nan),
        ("wrist conditions", "mobility", lambda value: dataclasses.replace(value, rank=value.rank + 1)),
    ],
)
def test_a_wrong_chain_is_found(monkeypatch, name, method, spoil):
    original = getattr(ep.ClosedChain, method)
    monkeypatch.setattr(ep.ClosedChain, method, lambda self, *a, **k: spoil(original(self, *a, **k)))
    report = check(ep.load("prototype").mechanism)
    assert outcome(report, name).outcome == "fail"
    assert not report.passed
    assert "NOT CONSISTENT" in str(report)


def test_axes_that_miss_the_centre_by_a_nanometre_are_found(monkeypatch):
    moved = {**vars(pin), "computeJointJacobians": lambda *given: pin.computeJointJacobians(*given) + 1e-9}
    monkeypatch.setattr("exo_pin.consistency.checks.pin", types.SimpleNamespace(**moved))
    found = outcome(check(ep.load("prototype").mechanism), "wrist conditions")
    assert found.outcome == "fail"
    assert "at most 1.7e-09 m, rad; without the ball joint 3" in found.detail


def test_an_impossible_inertia_is_found():
    arm = ep.Arm(1.0, [0, 0, -0.2], np.diag([1e-3, 1e-3, 1e-3]))
    object.__setattr__(arm, "inertia", np.diag([1e-3, 1e-3, -1e-3]))
    mechanism = ep.load("prototype").mechanism.replace(arm=arm)
    assert outcome(check(mechanism), "chain").outcome == "fail"
    thin = ep.thesis_rotation(0.3, 0.5, 0.7).as_matrix()
    rod = ep.Arm(1.0, [0, 0, -0.2], thin @ np.diag([0.03, 0.03, 0.0]) @ thin.T)
    assert ep.load("prototype").replace(arm=rod).check().passed


def test_axes_that_miss_the_centre_are_found(monkeypatch):
    """A chain whose base joints point past O by a tenth of a milliradian still closes, but is not a wrist."""
    from exo_pin.wrist_chain import equilibrium

    original = equilibrium.mechanism_urdf

    def bent(mechanism, part="whole", assumed=None, visuals=True):
        xml, closures = original(mechanism, part, assumed, visuals)
        head, tail = xml.split('<joint name="limb_1_base_y"', 1)
        before, after = tail.split('<axis xyz="', 1)
        numbers, rest = after.split('"', 1)
        axis = np.array([float(number) for number in numbers.split()])
        axis[0] += 1e-4
        axis /= np.linalg.norm(axis)
        changed = " ".join(repr(float(value)) for value in axis)
        return f'{head}<joint name="limb_1_base_y"{before}<axis xyz="{changed}"{rest}', closures

    monkeypatch.setattr(equilibrium, "mechanism_urdf", bent)
    report = check(ep.load("prototype").mechanism)
    assert outcome(report, "wrist conditions").outcome == "fail"
    assert not report.passed
