"""A device that does not reach a pose says how far it gets."""

import re

import numpy as np
from places import URDF

import exo_pin as ep
from exo_pin.device import Drive, Route


def four_bar_device(length):
    """An arm that a rod of a length holds to the torso: its loop lets the elbow-side end no further away."""
    xml = (
        '<robot name="rod"><link name="arm"><inertial><mass value="4"/><origin xyz="0 0 -0.3"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    ends = ep.chain.Placement((0.0, 0.0, -0.2)), ep.chain.Placement((0.3, 0.0, -0.2))
    rod = ep.chain.Closure("rod", "distance", "arm", "universe", *ends, distance=length)
    roles = ep.chain.Roles(arm="arm", shoulder="root_joint")
    closures = ep.chain.Closures("rod", ep.chain.Root("spherical"), (rod,), roles)
    return ep.ShoulderExo.from_chain(ep.ClosedChain.from_urdf(xml, closures))


def test_a_rod_lets_the_arm_go_as_far_as_it_is_long():
    exo = four_bar_device(0.3)
    cable = Drive("cable", route=Route.over(("universe", (0.0, 0.0, 0.3)), ("arm", (0.0, 0.05, -0.2))))
    exo = exo.replace(drives=[cable])
    answer = exo.reaction(exo.pose(60, 0), limits="none")
    assert answer.status == "out_of_reach"
    assert np.isnan(answer.shoulder_force).all()
    # The rod holds the point at its length: the arm cannot flex at all, and the way ends where it begins.
    told = re.search(r"as far as flexion (-?\d+)°|do not close even at rest", answer.verdict)
    assert told


def test_the_way_from_rest_is_followed_to_its_end():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    poses = exo.pose([0.0, 90.0, 170.0], [0.0, 30.0, 0.0])
    for q, R in zip(exo.configurations(poses), poses.as_matrix(), strict=True):
        assert np.abs(exo.chain.residual(q)).max() < 1e-12
        np.testing.assert_allclose(exo.chain.placement(q, "arm").rotation, R, atol=1e-12)


def test_a_device_says_where_digits_leave_a_singular_pose_open():
    """As its chain does: a wrist of a file of seven decimals beside a singular pose, and far from one."""
    exact = ep.load(URDF / "prototype.urdf")
    rounded = ep.ShoulderExo.from_device(exact.device.replace(chain=exact.device.chain.with_tolerance(5e-8)))
    poses = exact.pose(flexion=[35.45, 90.0])
    assert exact.singularity(poses).kind.tolist() == ["near", "regular"]
    assert rounded.singularity(poses).kind.tolist() == ["undetermined", "regular"]
    for pose, verdict in zip(poses, ("singular", "regular"), strict=True):
        assert rounded.chain.mobility(rounded.configurations(pose), part="orientation").verdict == verdict
        said = [text for text in rounded.reaction(pose).cautions if text.startswith("Undetermined")]
        assert bool(said) == (verdict != "regular")
