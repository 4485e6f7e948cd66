"""Sweeps and comparisons on the command line."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.design import DEFAULT_PRESET


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def test_default_design_holds_most_daily_poses_on_everyone():
    sizes = (ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
    names = ("stroke", "forces", "clearance")
    limits = ep.Criteria(names, wearers=sizes, elbow_range=np.radians([0.0, 130.0]))
    designs = [exo for exo in map(ep.load, ep.presets()) if exo.mechanism.limbs[0].stroke is not None]
    assert len(designs) == 8
    share = {exo.name: exo.workspace(20.0, limits).index for exo in designs}
    assert max(share, key=share.get) == DEFAULT_PRESET
    assert share["prototype"] < 0.01
