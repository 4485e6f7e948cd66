import numpy as np
import pytest
from mechanisms import random_wrist

from exo_pin import thesis_rotation
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


@pytest.mark.parametrize("pose", range(len(POSES)))
def test_margins_of_the_wrist_are_its_limbs_jacobian(pose):
    # d(lengths)/dt = J ω: travel is its norm, and effort per moment the norm of its inverse, as in the closed form.
    mechanism = preset("prototype")
    chain = wrist_chain(mechanism, "whole")
    J = limb_jacobian(mechanism.geometry, POSES[pose])
    margins = chain.mobility(at(chain, POSES[pose]), part="orientation").margins
    assert margins.travel == pytest.approx({"m per rad": np.linalg.norm(J, 2)}, rel=1e-6)
    assert margins.effort == pytest.approx({"N per N m": np.linalg.norm(np.linalg.inv(J), 2)}, rel=1e-6)


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
