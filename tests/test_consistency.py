"""The consistency checks, on designs that pass and on designs made to fail."""

import numpy as np
import pytest
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import consistency
from exo_pin.consistency import CHECKS, check
from exo_pin.testing import consistency_checks

test_prototype = consistency_checks("prototype")
test_right_prototype = consistency_checks(ep.load("prototype", side="right"))
test_random_design_with_five_limbs = consistency_checks(
    random_mechanism(np.random.default_rng(1), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"])
)


@pytest.mark.parametrize("name", ep.presets())
def test_published_mechanisms_are_consistent(name):
    report = ep.load(name).check()
    assert report.passed, str(report)
    assert {finding.name for finding in report.findings} == set(CHECKS)


def outcome(report, name):
    return next(finding for finding in report.findings if finding.name == name)


def test_a_singular_neutral_pose_is_noted():
    singular = ep.load("prototype").replace(
        geometry=ep.load("prototype").geometry.replace(neutral=ep.thesis_rotation(90, 0, 0, degrees=True))
    )
    finding = outcome(singular.check(), "neutral pose")
    assert finding.outcome == "note"
    assert "singular" in finding.detail


def test_what_is_not_known_is_a_note():
    report = ep.load("scenario-one").check()
    assert outcome(report, "inertia").outcome == "note"
    assert outcome(ep.load("appendix-d").check(), "inertia").outcome == "note"
    assert "outside the stroke of limb 1" in outcome(ep.load("prototype").check(), "neutral pose").detail


@pytest.mark.parametrize(
    ("name", "broken"),
    [
        ("limb Jacobian", lambda _: ("limb_jacobian", lambda g, p: 1.0001 * ep.wrist.limb_jacobian(g, p))),
    ],
)
def test_a_wrong_jacobian_is_found(monkeypatch, name, broken):
    attribute, replacement = broken(None)
    monkeypatch.setattr(consistency, attribute, replacement)
    report = check(ep.load("prototype").mechanism)
    assert outcome(report, name).outcome == "fail"
    assert not report.passed
    assert "NOT CONSISTENT" in str(report)


def test_axes_that_miss_the_centre_are_found(monkeypatch):
    """A chain whose base joints point past O by a tenth of a milliradian still closes, but is no wrist."""
    from exo_pin.reaction import equilibrium

    original = equilibrium.mechanism_urdf

    def bent(mechanism, part="whole", assumed=None):
        xml, closures = original(mechanism, part, assumed)
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
