"""Overconstrained mechanisms of rounded geometry move as the exact ones, and what they cannot tell they say."""

import mujoco
import numpy as np
import pytest
from mujoco_exact import ExactMujoco
from rounded_files import FORMATS
from rounded_mechanisms import MECHANISMS, mechanism
from singular_poses import POSES, REGULAR

from exo_pin import NearSingularConfiguration

#: Errors of accelerations and reactions, as shares of the largest, over the tolerance of the geometry: at most 35
#: in 420 mechanisms.
_GROWTH = 100.0


def _forces(chain, q):
    # The delta's cranks; of the others the first hinge.
    driven = [f"hinge_{5 * k}" for k in range(MECHANISMS[chain.description.name])]
    v, _ = chain.dependent_motion(q, driven, np.ones(len(driven)))
    a = chain.forward_dynamics(q, v)
    held = chain.inverse_dynamics(q, v, a.a, actuated=driven)
    return (
        v,
        a.a,
        held.tau,
        np.concatenate([held.joint_reaction("hinge_1").force, a.forces.joint_reaction("hinge_1").force]),
    )


def _compare(name, digits, seed):
    exact, rounded = mechanism(name, None, seed), mechanism(name, digits, seed)
    zero = np.zeros(exact.model.nq)
    q = rounded.close(zero)
    here, there = rounded.mobility(q), exact.mobility(zero)
    assert here.rank == there.rank
    assert here.degrees_of_freedom == MECHANISMS[name]
    assert here.kinds == ()
    assert here.verdict == "regular"
    known = here.geometry
    np.testing.assert_allclose(rounded.close(q), q, atol=1e-12)
    for found, wanted in zip(_forces(rounded, q), _forces(exact, zero), strict=True):
        assert np.abs(found - wanted).max() <= _GROWTH * known * max(np.abs(wanted).max(), 1.0), (name, digits, seed)


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_rounded_mechanism_moves_as_the_exact_one(name):
    """Mobility, closing, accelerations and reactions at 4 to 10 decimals, turned at random."""
    for digits in (4, 6, 8, 10):
        _compare(name, digits, seed=3)


@pytest.mark.parametrize(
    "digits", [4, pytest.param(5, marks=pytest.mark.full), pytest.param(6, marks=pytest.mark.full)]
)
@pytest.mark.parametrize("name", MECHANISMS)
def test_loops_are_closed_as_well_as_the_digits_allow(name, digits):
    """Driven far from the drawn pose, from a start that is off, the joints are those of the exact mechanism."""
    exact, rounded = mechanism(name, None, 1), mechanism(name, digits, 1)
    tolerance, rng = 0.5 * 10.0**-digits, np.random.default_rng(digits)
    driven = [5 * k for k in range(MECHANISMS[name])]
    held, wanted = [f"hinge_{k}" for k in driven], np.zeros(exact.model.nq)
    for angle in (-0.25, -0.5, -0.75):
        off = wanted + rng.normal(scale=0.05, size=len(wanted))
        wanted[driven] = off[driven] = angle
        wanted, found = exact.close(wanted, hold=held), rounded.close(off, hold=held)
        assert np.abs(rounded.residual(found)).max() <= 15.0 * tolerance, angle
        assert np.abs(found - wanted).max() <= 300.0 * tolerance, angle


@pytest.mark.parametrize("angle", [3e-6, 2e-4, 5e-4, 2e-3])
def test_a_pose_whose_rank_the_digits_do_not_determine_is_said(angle):
    """Beside the flat pose the smallest singular value is as the angle, and near the tolerance no force follows."""
    chain = mechanism("planar", 5, seed=1, flat=True)
    q = chain.close(np.array([angle, 0.0, 0.0]), hold=["hinge_0"])
    found = chain.mobility(q)
    assert found.regular_rank == 2
    # The digits move the flat pose by the root of their size, and hide the last row within ten times the tolerance.
    assert found.verdict == "undetermined within the digits"
    near = found.singular_values[1] / found.tolerance
    if 0.1 < near < 10.0:
        with pytest.raises(NearSingularConfiguration):
            chain.forward_dynamics(q)
    elif angle == 2e-3:
        assert np.isfinite(chain.forward_dynamics(q).a).all()


@pytest.mark.parametrize("name", MECHANISMS)
def test_accelerations_are_mujocos_of_the_exact_mechanism(name, tmp_path):
    """MuJoCo's matrices of the exact mechanism, its equalities solved exactly; ours at six decimals."""
    exact, rounded = mechanism(name, None, 3), mechanism(name, 6, 3)
    oracle = ExactMujoco(mujoco.MjModel.from_xml_path(str(exact.to_mjcf(tmp_path))), exact)
    rest = np.zeros(exact.model.nv)
    wanted = oracle.acceleration(oracle.qpos_of(rest), rest, rest)
    found = rounded.forward_dynamics(rounded.close(rest), rest).a
    assert np.abs(found - wanted).max() <= _GROWTH * 5e-7 * np.abs(wanted).max()


def _verdict(chain):
    found = chain.mobility(chain.close(chain.neutral()))
    assert str(found.freedoms[1]) in str(found)
    return found


@pytest.mark.parametrize("name", [*POSES, *REGULAR])
def test_digits_change_no_verdict(name):
    """Textbook poses of 4 to 8 decimals: the exact count within what is said, singular or undetermined as the exact."""
    drawing, singular = (POSES | REGULAR)[name], name in POSES
    exact = _verdict(drawing.chain())
    assert exact.verdict == ("singular" if singular else "regular")
    for digits in (7, 4):
        found = _verdict(drawing.chain(digits, seed=digits))
        assert found.verdict in (exact.verdict, "undetermined within the digits" if singular else "regular"), digits
        for one, other in ((found, exact), (found.locked, exact.locked)):
            assert one.freedoms[0] <= other.degrees_of_freedom <= one.freedoms[1], digits


#: The 3-UPU at all digits, and all poses at five; URDF has no ball joint.
_FILES = [("3-UPU at home", form, digits) for form in FORMATS for digits in (8, 7, 6, 4)] + [
    (name, form, 5)
    for name, drawing in POSES.items()
    for form in FORMATS
    if form != "urdf" or all(kind != "S" for _, kind, _, _ in drawing.joints)
]


@pytest.mark.parametrize(
    ("name", "form", "digits"),
    [pytest.param(*file, marks=() if file == ("3-UPU at home", "mjcf", 5) else pytest.mark.full) for file in _FILES],
)
def test_a_singular_drawing_is_known_by_every_format(name, form, digits, tmp_path):
    """Hinges are two points each in MJCF, which its digits leave open, one file's by less than others of its digits."""
    exact = POSES[name].chain(seed=1)
    expected = exact.mobility(exact.close(exact.neutral()))
    chain = FORMATS[form](exact, digits, tmp_path)
    found = chain.mobility(chain.close(chain.reference_configuration()))
    for own, other in ((found, expected), (found.locked, expected.locked)):
        assert own.freedoms[0] <= other.degrees_of_freedom <= own.freedoms[1]
    assert found.verdict in ("singular", "undetermined within the digits")
