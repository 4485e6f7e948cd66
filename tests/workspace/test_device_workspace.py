"""The workspace of a device that is not a wrist against its own answers, and gaps against sampled surfaces."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import ChainDevice

MAN = ep.Wearer(1.755, 85.0, "male")


@pytest.fixture(scope="module")
def serial():
    return ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)


def test_the_same_wrist_has_the_same_held_poses_both_ways():
    exo = ep.load("four-linear-actuators-worn")
    device = ChainDevice.from_chain(exo.chain).replace(arm=exo.arm)
    limits = [d.__class__(d.name, d.joint, pulls=True, lower=-600.0, upper=600.0, least=d.least, greatest=d.greatest)
              for d in device.drives]  # fmt: skip
    poses = exo.pose(*np.meshgrid([0.0, 30.0, 60.0, 90.0], [0.0, 40.0]))
    names = ep.Criteria(("stroke", "forces"))
    one, other = (
        exo.workspace(poses, names),
        ep.ShoulderExo.from_device(device.replace(drives=limits)).workspace(poses, names),
    )
    np.testing.assert_array_equal(one.inside, other.inside)
    np.testing.assert_allclose(other.margins["forces"], one.margins["forces"], rtol=1e-6)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-5)
