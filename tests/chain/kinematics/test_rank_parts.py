"""Ranks near a configuration, rows that agree by the digits of a geometry, and settling: planar loops by hand."""

from dataclasses import replace

import mechanisms
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import LoopNotClosed
from exo_pin.chain import ClosedChain
from exo_pin.chain.kinematics.closing import neighbours
from exo_pin.chain.kinematics.loops import scaled_jacobian
from exo_pin.chain.kinematics.rank import rank_tolerance, self_consistent_error
from exo_pin.chain.kinematics.structural_rank import _opening, _rank, _settled, _zero, agreeing_rows, structural_rank

pytestmark = pytest.mark.usefixtures("plain")

#: From a closed configuration, rad.
OFF = np.array([0.02, -0.03, 0.01])


def four_bar(tolerance=0.0, tilt=0.0):
    """Three rows of a ball joint in a plane, of which one is redundant; ``tilt`` turns one hinge's axis out of it."""
    named = mechanisms.four_bar()
    urdf = named.urdf
    if tilt:
        axis = Rotation.from_rotvec([tilt, 0.0, 0.0]).apply([0.0, 0.0, 1.0])
        at = urdf.index('name="crank_hinge"')
        urdf = urdf[:at] + urdf[at:].replace("0.0 0.0 1.0", " ".join(f"{x:.17g}" for x in axis), 1)
        assert urdf != named.urdf
    return ClosedChain.from_urdf(urdf, replace(named.closures, tolerance=tolerance)), named.q


def test_four_bars_have_two_rows_besides_the_one_across_their_plane():
    chain, q = four_bar()
    state = chain._state
    assert structural_rank(state, q, None) == 2
    assert agreeing_rows(state, q) == (0, 0.0)
    # One column has one row, two have two.
    assert structural_rank(state, q, np.array([0])) == 1
    assert structural_rank(state, q, np.array([0, 2])) == 2
    # It is found once.
    state.structural_ranks[None] = 7
    assert structural_rank(state, q, None) == 7


def test_the_rank_of_a_flat_loop_is_that_beside_it():
    """All links along one line: a row fewer there, as in no configuration near it."""
    flat = ClosedChain.from_urdf(*mechanisms.flat_parallelogram())
    line = np.zeros(3)
    J, _ = scaled_jacobian(flat._state, line)
    assert np.abs(flat.residual(line)).max() < 1e-12
    assert np.linalg.matrix_rank(J, tol=1e-9) == 1
    assert structural_rank(flat._state, line, None) == 2
    Vt = np.linalg.svd(J)[2]
    beside = list(neighbours(flat._state, line, Vt[1:].T, np.zeros(0, dtype=int)))
    assert len(beside) > 0
    for there in beside:
        assert np.abs(flat.residual(there)).max() <= 1e-12
        assert 1e-3 < np.abs(there).max() < 0.5
    # Without a motion there is no neighbour.
    assert list(neighbours(flat._state, line, np.zeros((3, 0)), np.zeros(0, dtype=int))) == []


@pytest.mark.parametrize(("tilt", "rows"), [(1e-6, 1), (0.0, 0)])
def test_rows_that_digits_part_agree_within_the_tolerance(tilt, rows):
    """The tilt moves the tip across the plane by its size; a tolerance near that leaves no clear choice."""
    chain, q = four_bar(1e-4, tilt)
    count, size = agreeing_rows(chain._state, q)
    assert count == rows
    exact, _ = four_bar(0.0, tilt)
    assert structural_rank(exact._state, q, None) == 2 + rows
    assert structural_rank(chain._state, q, None) == 2
    if rows:
        last = np.linalg.svd(scaled_jacobian(exact._state, q)[0], compute_uv=False)[2]
        assert last <= size < 1e-5
        unclear, _ = four_bar(1e-7, tilt)
        assert agreeing_rows(unclear._state, q) is None


@pytest.mark.parametrize("factor", [1.0, 10.0])
@pytest.mark.parametrize("tolerance", [0.0, 1e-6])
def test_loops_are_closed_up_to_ten_times_the_tolerance_of_each_joint(tolerance, factor):
    """In metres, of chains larger than a metre in characteristic lengths; 0.5 m turn at 45° to the coupler."""
    chain, q = four_bar(tolerance)
    chain = mechanisms.enlarged(chain, factor)
    length = chain.characteristic_length
    assert (length > 1.0) == (factor > 1.0)
    most = 10.0 * chain.model.njoints * tolerance * max(length, 1.0) if tolerance else 1e-8
    for share in (0.99, 1.01):
        there = q + np.array([0.0, 0.0, share * most / (factor * 0.5 * np.sqrt(0.5))])
        assert np.abs(chain.residual(there)).max() == pytest.approx(share * most, rel=1e-3)
        if share < 1.0:
            chain.project_velocity(there, np.ones(3))
        else:
            with pytest.raises(LoopNotClosed):
                chain.project_velocity(there, np.ones(3))


def test_loops_settle_whatever_does_not_move_with_them():
    chain = mechanisms.with_free_hinge(mechanisms.four_bar())
    there = _settled(chain._state, np.append(mechanisms.four_bar().q + OFF, 0.3), 2)
    assert np.abs(chain.residual(there)).max() < 1e-12
    assert there[3] == 0.3


def test_zero_is_the_rounding_of_the_jacobian_and_the_gap():
    chain, _ = four_bar()
    state, values = chain._state, np.array([2.0, 0.3, 1e-6])
    for gap in (0.0, 1e-9, 1e-3):
        expected = rank_tolerance((3, 3), 2.0, chain.model.njoints, gap)
        assert _zero(state, values, gap) == pytest.approx(expected)
    assert [_rank(state, values, gap) for gap in (0.0, 1e-8, 1e-3, 1.0)] == [3, 3, 2, 0]
    assert _rank(state, np.array([1.0, 3e-15]), 0.0) == 1


def test_loops_settle_in_the_directions_of_a_rank_or_not_from_far():
    chain, q = four_bar()
    state = chain._state
    there = _settled(state, q + OFF, 2)
    assert np.abs(chain.residual(there)).max() < 1e-12
    assert 1e-3 < np.abs(there - q).max() < 0.1
    # In one direction alone the other stays open; in none nothing moves.
    start = q + OFF
    half = _settled(state, start, 1)
    assert np.linalg.norm(chain.residual(half)) < np.linalg.norm(chain.residual(start))
    assert np.abs(chain.residual(half)).max() > 1e-5
    np.testing.assert_array_equal(_settled(state, start, 0), start)
    assert _settled(state, q + 60.0 * OFF, 2) is None


@pytest.mark.parametrize("factor", [1.0, 10.0])
def test_an_open_loop_allows_the_tolerance_that_opens_it_by_a_third(factor):
    chain, q = four_bar()
    chain = mechanisms.enlarged(chain, factor)
    chain._state.buffers.linearise(q + 1e-3 * OFF)
    gap = np.abs(chain._state.buffers.gap).max()
    length = chain.characteristic_length
    assert 1e-7 < gap < 1e-4
    needed = _opening(chain._state)
    # A closed loop may be open by ten times the tolerance of each joint, in characteristic lengths.
    assert needed * 10.0 * chain.model.njoints * max(1.0, length) == pytest.approx(3.0 * gap)


def test_rows_that_hold_nothing_leave_no_error():
    """Both links turn about one line: the loop that their hinges close allows every motion of the tree."""
    for shape in ((0, 2), (5, 0), (4, 1)):
        assert self_consistent_error(np.zeros(shape), 2, 1e-12) == 0.0
    text = """<mujoco><worldbody><body name="wheel"><joint axis="0 0 1"/><geom size="0.1"/></body></worldbody>
    <equality><connect name="pin" body1="wheel" anchor="0 0 0"/></equality></mujoco>"""
    chain = ClosedChain.from_mjcf(text)
    found = chain.mobility(chain.neutral(), actuated=())
    assert (found.rank, found.degrees_of_freedom, found.redundant) == (0, 1, 3)
