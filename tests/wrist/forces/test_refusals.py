"""What holds for massless limbs alone is refused for limbs with mass."""

import numpy as np
import pytest
from wrists import heavy_limbs

import exo_pin as ep
from exo_pin import wrist


def test_wrench_feasibility_is_of_massless_limbs():
    exo = ep.load("four-cables").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    pose = exo.pose(60, 30)
    light = wrist.holding(exo.mechanism, pose)
    assert light.status == "ok"
    heavy = heavy_limbs(exo.mechanism, np.random.default_rng(0))
    with pytest.raises(ep.InvalidInput, match="mass"):
        wrist.holding(heavy, pose)
