"""Margins of open chains whose effort, travel and play are known by hand, and freedoms that are nobody's."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain, Closures

pytestmark = pytest.mark.usefixtures("plain")


def open_chain(*joints):
    """Joints one on the other: (kind, place)."""
    model = pin.Model()
    for k, (kind, place) in enumerate(joints):
        model.addJoint(k, kind(), pin.SE3(np.eye(3), np.array(place, dtype=float)), f"j{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"b{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return ClosedChain(model, Closures("open"))


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_crank_has_its_length_as_effort_and_the_inverse_as_travel(turn):
    """Its end, 0.4 m out on a second body that is held: a force of 1 N across needs 0.4 N m."""
    chain = open_chain((pin.JointModelRZ, [0, 0, 0]), (pin.JointModelRZ, [0.4, 0, 0]))
    found = chain.mobility([turn, 0.2], locked=["j1"], actuated=["j0"], frame="b1", part="position")
    margins = found.margins
    assert dict(margins.effort) == pytest.approx({"N m per N": 0.4})
    assert dict(margins.travel) == pytest.approx({"rad per m": 2.5})
    assert found.idle == 0
    assert "0.4 N m per N on b1" in str(margins)


def test_two_cranks_have_the_singular_values_of_their_jacobian():
    lengths, q = np.array([0.4, 0.3]), np.array([0.5, 1.1])
    places = ((pin.JointModelRZ, [0, 0, 0]), (pin.JointModelRZ, [0.4, 0, 0]), (pin.JointModelRX, [0.3, 0, 0]))
    chain = open_chain(*places)
    found = chain.mobility([*q, 0.0], locked=["j2"], actuated=["j0", "j1"], frame="b2", part="position")
    ends = np.cumsum(q)
    across, along = lengths * np.sin(ends), lengths * np.cos(ends)
    J = np.array([[-across.sum(), -across[1]], [along.sum(), along[1]]])
    values = np.linalg.svd(J, compute_uv=False)
    assert dict(found.margins.effort) == pytest.approx({"N m per N": values[0]})
    assert dict(found.margins.travel) == pytest.approx({"rad per m": 1.0 / values[1]})
    assert found.kinds == ()
    # Stretched, the end cannot move outwards while the cranks can turn against each other.
    stretched = chain.mobility([0.5, 0.0, 0.0], locked=["j2"], actuated=["j0", "j1"], frame="b2", part="position")
    assert stretched.kinds == ("input",)
    assert dict(stretched.margins.travel) == {"rad per m": np.inf}
    assert np.isfinite(stretched.margins.effort["N m per N"])
    # An output that one locked crank does not hold.
    loose = chain.mobility([*q, 0.0], locked=["j2"], actuated=["j0"], frame="b2", part="position").margins
    assert loose.effort["N m per N"] == np.inf


def test_a_slide_and_a_hinge_have_a_margin_for_each_unit():
    chain = open_chain((pin.JointModelPX, [0, 0, 0]), (pin.JointModelRZ, [0, 0, 0]))
    found = chain.mobility([0.3, 0.2], actuated=["j0", "j1"], frame="b1").margins
    expected = {"N per N": 1.0, "N per N m": 0.0, "N m per N": 0.0, "N m per N m": 1.0}
    assert dict(found.effort) == pytest.approx(expected, abs=1e-12)
    expected = {"m per m": 1.0, "m per rad": 0.0, "rad per m": 0.0, "rad per rad": 1.0}
    assert dict(found.travel) == pytest.approx(expected, abs=1e-12)
    assert list(found.effort) == ["N per N", "N per N m", "N m per N", "N m per N m"]
