"""Gaps between links of a device and its wearer against sampled capsules."""

import numpy as np
import pinocchio as pin
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import BodyShape
from exo_pin.device.clearance import link_capsules

MAN = ep.Wearer(1.755, 85.0, "male")


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr"])
def test_gaps_of_links_are_those_of_sampled_capsules(name):
    exo = ep.load(URDF / f"{name}.urdf")
    body = BodyShape.of(MAN)
    poses = exo.pose([0.0, 50.0, 80.0], [0.0, 40.0, 10.0])
    q, R = exo.configurations(poses), poses.as_matrix()
    gaps = exo.device.gaps(R, body=body).least
    capsules, radii, *_ = link_capsules(exo.device)
    assert len(radii) > 10
    t = np.linspace(0.0, 1.0, 60)[:, None]
    for k in range(len(q)):
        model, data = exo.chain.model, exo.chain.model.createData()
        pin.forwardKinematics(model, data, q[k])
        for part, rows in ((0, body.arm), (1, body.torso)):
            turn = R[k] if part == 0 else np.eye(3)
            least = np.inf
            for row, radius in zip(capsules, radii, strict=True):
                place = data.oMi[int(row[6])]
                link = (1 - t) * place.act(row[:3]) + t * place.act(row[3:6])
                for other in rows:
                    own = ((1 - t) * other[:3] + t * other[3:6]) @ turn.T
                    apart = np.linalg.norm(link[:, None] - own[None], axis=-1).min()
                    least = min(least, apart - radius - other[6])
            # Sixty points on each axis come within a sixtieth of its length of the nearest ones, and never nearer.
            assert gaps[k, part] <= least + 1e-9
            assert least - gaps[k, part] < 0.006
