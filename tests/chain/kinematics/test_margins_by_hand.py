"""Margins of open chains whose effort, travel and play are known by hand, and freedoms that are nobody's."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, parallelogram, with_free_hinge
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closures, Mobility

pytestmark = pytest.mark.usefixtures("plain")

SLIDES = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)
HINGES = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)


def open_chain(*joints):
    """Joints one on the other: (kind, place)."""
    model = pin.Model()
    for k, (kind, place) in enumerate(joints):
        model.addJoint(k, kind(), pin.SE3(np.eye(3), np.array(place, dtype=float)), f"j{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"b{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return ClosedChain(model, Closures("open"))


@pytest.mark.parametrize("axis", range(3))
def test_a_slide_and_a_hinge_drive_their_own_body_one_to_one(axis):
    slide, hinge = open_chain((SLIDES[axis], [0, 0, 0])), open_chain((HINGES[axis], [0, 0, 0]))
    found = slide.mobility([0.1], actuated=["j0"], frame="b0", part="position").margins
    assert dict(found.effort) == pytest.approx({"N per N": 1.0})
    assert dict(found.travel) == pytest.approx({"m per m": 1.0})
    found = hinge.mobility([0.1], actuated=["j0"], frame="b0", part="orientation").margins
    assert dict(found.effort) == pytest.approx({"N m per N m": 1.0})
    assert dict(found.travel) == pytest.approx({"rad per rad": 1.0})
    both = hinge.mobility([0.1], actuated=["j0"], frame="b0").margins
    assert dict(both.effort) == pytest.approx({"N m per N": 0.0, "N m per N m": 1.0})


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


@pytest.mark.parametrize("idle", [0, 1, 2, 3])
def test_freedoms_behind_the_output_are_idle_and_change_no_margin(idle):
    chain = open_chain((pin.JointModelPX, [0, 0, 0]), *[(pin.JointModelRX, [0.2, 0, 0])] * idle)
    found = chain.mobility(np.zeros(1 + idle), actuated=["j0"], frame="b0", part="position")
    assert (found.idle, found.kinds) == (idle, ())
    assert (found.degrees_of_freedom, found.locked.degrees_of_freedom) == (1 + idle, idle)
    assert dict(found.margins.effort) == pytest.approx({"N per N": 1.0})
    assert dict(found.margins.travel) == pytest.approx({"m per m": 1.0})
    assert ("idle freedoms" in str(found)) == (idle > 0)


def test_a_slide_and_a_hinge_have_a_margin_for_each_unit():
    chain = open_chain((pin.JointModelPX, [0, 0, 0]), (pin.JointModelRZ, [0, 0, 0]))
    found = chain.mobility([0.3, 0.2], actuated=["j0", "j1"], frame="b1").margins
    expected = {"N per N": 1.0, "N per N m": 0.0, "N m per N": 0.0, "N m per N m": 1.0}
    assert dict(found.effort) == pytest.approx(expected, abs=1e-12)
    expected = {"m per m": 1.0, "m per rad": 0.0, "rad per m": 0.0, "rad per rad": 1.0}
    assert dict(found.travel) == pytest.approx(expected, abs=1e-12)
    assert list(found.effort) == ["N per N", "N per N m", "N m per N", "N m per N m"]


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "parallelogram"])
@pytest.mark.parametrize("axis", range(3))
def test_margins_of_a_loop_are_the_same_however_it_lies_in_space(name, axis):
    """The plane of a planar loop is turned: its turn about any axis of the world, stay."""
    named = {"four-bar": four_bar, "five-bar": five_bar, "parallelogram": parallelogram}[name]()
    chain = named.chain()
    q, joints = chain.close(named.q), [str(name) for name in list(chain.model.names)[1:]]
    frame = {"four-bar": "coupler", "five-bar": "right_forearm", "parallelogram": "bar"}[name]
    driven = joints[:1] if name != "five-bar" else ["left_crank_hinge", "right_crank_hinge"]
    turn = pin.SE3(Rotation.align_vectors([np.eye(3)[axis]], [[0.0, 0.0, 1.0]])[0].as_matrix(), np.zeros(3))
    model = chain.model.copy()
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = turn * model.jointPlacements[joint]
    turned = ClosedChain(model, chain.description)
    one, other = (each.mobility(q, actuated=driven, frame=frame) for each in (chain, turned))
    assert (one.kinds, one.idle, one.rank) == (other.kinds, other.idle, other.rank)
    for kind in ("effort", "travel"):
        assert dict(getattr(one.margins, kind)) == pytest.approx(dict(getattr(other.margins, kind)), rel=1e-9)


def test_the_digits_leave_freedoms_in_doubt_or_forces_uncertain():
    """By the number of freedoms that they allow; forces by the weakest direction, over the tolerance of the rest."""
    doubtful = Mobility(4, 5, 2, 3, np.array([1.0, 3e-2, 3e-8, 2e-8]), 1e-8, 0.4, geometry=1e-6, freedoms=(2, 3))
    assert doubtful.verdict == "undetermined within the digits"
    (text,) = doubtful.cautions
    assert "for 2 to 3 degrees of freedom: the smallest singular value is 3e-08" in text
    for geometry, said in ((1e-3, ("the digits of the geometry leave forces uncertain by about 5 %",)), (1e-4, ())):
        sure = replace(doubtful, geometry=geometry, freedoms=(3, 3))
        assert (sure.verdict, sure.cautions) == ("regular", said)


@pytest.mark.parametrize("named", [four_bar(), parallelogram()], ids=["four-bar", "parallelogram"])
def test_a_body_that_turns_freely_behind_a_joint_changes_no_margin_of_a_loop(named):
    bare, chain, q = named.chain(), with_free_hinge(named), named.q
    driven, frame = bare.roles.actuated, bare.roles.arm or "rocker"
    own = bare.mobility(q, actuated=driven, frame=frame)
    other = chain.mobility(np.append(q, 0.3), actuated=driven, frame=frame)
    assert (own.idle, other.idle) == (0, 1)
    for kind in ("effort", "travel"):
        assert dict(getattr(other.margins, kind)) == pytest.approx(dict(getattr(own.margins, kind)), rel=1e-9)


def test_a_tree_has_no_singular_value_and_no_redundancy():
    found = open_chain((pin.JointModelPX, [0, 0, 0]), (pin.JointModelRZ, [0.2, 0, 0])).mobility(np.zeros(2))
    assert (found.rows, found.rank, found.coordinates, found.degrees_of_freedom) == (0, 0, 2, 2)
    assert (found.smallest, found.redundant, dict(found.redundant_closures), found.cautions) == (0.0, 0, {}, ())
    assert (found.locked, found.margins, found.idle, found.kinds) == (None, None, None, ())
    assert "rank 0 of 0 rows on 2 coordinates, smallest singular value 0\n" in str(found)
    # Of an exact geometry, unless it is said.
    assert Mobility(3, 4, 2, 2, np.array([1.0, 0.5, 1e-9]), 1e-8, 0.4).geometry == 0.0
