import numpy as np
import pytest
from mechanisms import five_bar, four_bar, random_wrist

from exo_pin import InvalidInput, LoopNotClosed, thesis_rotation
from exo_pin.chain import ClosedChain, Closure, Closures, Placement, Roles
from exo_pin.design import preset
from exo_pin.wrist import limb_jacobian
from exo_pin.wrist_chain import mechanism_urdf


def wrist_chain(mechanism, part):
    return ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))


def at(chain, orientation):
    """The chain closed with its arm held at an orientation, its root at O."""
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root] = np.concatenate([np.zeros(root.stop - root.start - 4), orientation.as_quat()])
    return chain.close(q, hold=["root_joint"])


ANGLES = [(0, 0, 0), (40, -20, -30), (-60, 10, 25), (20, -50, 5), (70, 30, -10)]
POSES = [thesis_rotation(*angles, degrees=True) for angles in ANGLES]
# Both plates parallel: the one pose here that is singular.
SINGULAR = thesis_rotation(90, 0, 0, degrees=True)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("pose", range(len(POSES)))
@pytest.mark.parametrize(
    ("part", "rows", "coordinates", "rank"), [("whole", 18, 18, 15), ("wrist", 18, 21, 18), ("floating", 21, 21, 18)]
)
def test_the_prototype_has_three_freedoms(side, pose, part, rows, coordinates, rank):
    chain = wrist_chain(preset("prototype").on_side(side), part)
    mobility = chain.mobility(at(chain, POSES[pose]))
    assert (mobility.rows, mobility.coordinates, mobility.rank) == (rows, coordinates, rank)
    assert mobility.degrees_of_freedom == 3
    assert mobility.redundant == rows - rank
    # The gap between what counts and what does not is wide: the tolerance decides nothing by a hair.
    assert mobility.smallest > 1e3 * mobility.tolerance
    assert (mobility.singular_values[rank:] < 0.1 * mobility.tolerance).all()


@pytest.mark.parametrize(("part", "full"), [("whole", 18), ("floating", 21)])
def test_locked_actuators_hold_the_arm_except_at_the_singular_pose(part, full):
    chain = wrist_chain(preset("prototype"), part)
    for pose in POSES:
        mobility = chain.mobility(at(chain, pose), locked=chain.roles.actuated)
        assert (mobility.rows, mobility.rank, mobility.degrees_of_freedom) == (full + 3, full, 0)
    q = at(chain, SINGULAR)
    assert chain.mobility(q).rank == full - 3
    mobility = chain.mobility(q, locked=chain.roles.actuated)
    assert (mobility.rank, mobility.degrees_of_freedom) == (full - 1, 1)


def test_without_the_ball_joint_the_singular_pose_drops_the_rank():
    chain = wrist_chain(preset("prototype"), "wrist")
    assert chain.mobility(at(chain, SINGULAR)).rank == 17


def test_locked_actuators_leave_the_smaller_margin_the_nearer_the_singularity():
    chain = wrist_chain(preset("prototype"), "whole")
    margins = [
        chain.mobility(at(chain, thesis_rotation(angle, 0, 0, degrees=True)), chain.roles.actuated).smallest
        for angle in (89.0, 89.9, 89.99)
    ]
    # Along abduction the determinant has a double zero at 90°, so the margin is quadratic in the distance.
    assert margins[0] / margins[1] == pytest.approx(100, rel=0.02)
    assert margins[1] / margins[2] == pytest.approx(100, rel=0.002)


def test_the_effort_grows_without_bound_towards_the_singularity():
    chain = wrist_chain(preset("prototype"), "whole")
    efforts = [
        chain.mobility(at(chain, thesis_rotation(angle, 0, 0, degrees=True))).margins.effort["N per N m"]
        for angle in (89.9, 89.99, 89.999)
    ]
    assert efforts[1] / efforts[0] == pytest.approx(100, rel=0.02)
    assert efforts[2] / efforts[1] == pytest.approx(100, rel=0.02)
    assert chain.mobility(at(chain, SINGULAR)).margins.effort["N per N m"] == np.inf


@pytest.mark.parametrize("pose", range(len(POSES)))
def test_margins_of_the_wrist_are_its_limbs_jacobian(pose):
    # d(lengths)/dt = J ω: travel is its norm, and effort per moment the norm of its inverse, as in the closed form.
    mechanism = preset("prototype")
    chain = wrist_chain(mechanism, "whole")
    J = limb_jacobian(mechanism.geometry, POSES[pose])
    margins = chain.mobility(at(chain, POSES[pose]), part="orientation").margins
    assert margins.travel == pytest.approx({"m per rad": np.linalg.norm(J, 2)}, rel=1e-6)
    assert margins.effort == pytest.approx({"N per N m": np.linalg.norm(np.linalg.inv(J), 2)}, rel=1e-6)


def test_a_chain_that_is_locked_altogether():
    named = five_bar()
    mobility = named.chain().mobility(named.q, locked=["left_crank_hinge", "right_crank_hinge"], frame="tip")
    assert (mobility.degrees_of_freedom, mobility.locked, mobility.margins, mobility.kinds) == (0, None, None, ())
    mobility = named.chain().mobility(
        named.q, locked=["left_forearm_hinge", "right_forearm_hinge"], actuated=["left_crank_hinge"], frame="tip"
    )
    assert mobility.degrees_of_freedom == 0
    assert mobility.margins.effort["N m per N"] == 0.0
    with pytest.raises(InvalidInput, match="not actuated"):
        named.chain().mobility(named.q, locked=["left_crank_hinge"], actuated=["left_crank_hinge"])


def test_idle_turns_are_no_singularity():
    # A rod on two ball joints spins about itself: the locked actuator leaves that, and it is not the output's.
    urdf = """<robot name="rod"><link name="ground"/><link name="slider"/>
      <joint name="slide" type="prismatic"><parent link="ground"/><child link="slider"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
      <link name="rod"/><joint name="flight" type="floating"><parent link="slider"/><child link="rod"/></joint>
      <link name="crank"/><joint name="hinge" type="revolute"><parent link="ground"/><child link="crank"/>
        <origin xyz="0.5 0.3 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    </robot>"""
    ends = (
        Closure("one", "spherical", "rod", "slider"),
        Closure("two", "spherical", "rod", "crank", Placement((0.5, 0, 0)), Placement((0, -0.3, 0))),
    )
    chain = ClosedChain.from_urdf(urdf, Closures("rod", closures=ends, roles=Roles(("slide",), arm="crank")))
    mobility = chain.mobility(chain.neutral())
    assert np.abs(chain.residual(chain.neutral())).max() < 1e-15
    assert (mobility.degrees_of_freedom, mobility.locked.degrees_of_freedom, mobility.idle) == (2, 1, 1)
    assert mobility.kinds == ()
    # The crank's tip moves with the slider: 0.3 m a radian.
    assert mobility.margins.travel["m per rad"] == pytest.approx(0.3)
    assert mobility.margins.effort["N per N m"] == pytest.approx(1 / 0.3)


@pytest.mark.parametrize("kinds", ["SSS", "USUSU", "SSSS", "UUUUU"])
def test_wrists_of_mixed_limbs(kinds):
    mechanism = random_wrist(11, kinds)
    upu = kinds.count("U")
    for part in ("whole", "floating"):
        chain = wrist_chain(mechanism, part)
        mobility = chain.mobility(at(chain, thesis_rotation(0.2, -0.3, 0.1)))
        assert mobility.degrees_of_freedom == 3
        # With the ball joint, every UPU limb repeats one constraint.
        assert mobility.redundant == upu


def test_planar_mechanisms():
    # A point closure of planar links repeats the row across the plane, a rigid one three rows.
    for named, rows, freedoms, redundant in ((four_bar(), 3, 1, 1), (four_bar("link"), 6, 1, 3), (five_bar(), 3, 2, 1)):
        chain = named.chain()
        mobility = chain.mobility(named.q)
        assert (mobility.rows, mobility.degrees_of_freedom, mobility.redundant) == (rows, freedoms, redundant)
        assert chain.mobility(named.q, locked=chain.roles.actuated).degrees_of_freedom == 0


def test_a_folded_four_bar_gains_a_freedom_with_its_rocker_locked():
    # Crank and coupler in line: the rocker's dead point, where locking it leaves the crank's velocity free.
    named = four_bar()
    chain = named.chain()
    # Stretched out they would be 1.007 m long, which 0.4 + 0.5 cannot meet; the coupler folds back over the crank.
    reach = np.sqrt(0.5) - 0.3
    angle = np.arccos((0.4**2 + reach**2 - 0.5**2) / (2 * 0.4 * reach))
    tip = reach * np.array([np.cos(angle), np.sin(angle)])
    q = np.array([angle + np.pi, -np.pi, np.arctan2(tip[1], tip[0] - 0.4)])
    assert np.abs(chain.residual(q)).max() < 1e-15
    assert chain.mobility(q).degrees_of_freedom == 1
    assert chain.mobility(q, locked=["rocker_hinge"]).degrees_of_freedom == 1
    assert chain.mobility(q, locked=["crank_hinge"]).degrees_of_freedom == 0


def test_an_open_chain_has_no_mobility():
    named = five_bar()
    with pytest.raises(LoopNotClosed):
        named.chain().mobility(named.q + 0.01)


def test_a_chain_without_loops():
    chain = wrist_chain(preset("prototype"), "shoulder")
    mobility = chain.mobility(chain.neutral())
    assert (mobility.rows, mobility.rank, mobility.degrees_of_freedom, mobility.smallest) == (0, 0, 3, 0.0)
