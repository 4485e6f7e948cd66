"""What of MJCF is refused or left out."""

import mujoco
import pytest

from exo_pin.chain import ClosedChain


def test_a_limit_with_a_margin_is_where_mujoco_holds_the_joint():
    """A pendulum falls against its limit and comes to rest there; MuJoCo's limit gives way by its softness alone."""
    text = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="0.001"/><worldbody><body>
    <joint name="j" axis="0 1 0" range="0.2 2" margin="0.3" damping="2" limited="true" ref="1"/>
    <geom size="0.05" pos="-0.4 0 0.4"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    model.jnt_solimp[0] = [0.999, 0.9999, 0.001, 0.5, 2.0]
    data = mujoco.MjData(model)
    for _ in range(10000):
        mujoco.mj_step(model, data)
    low, high = (
        ClosedChain.from_mjcf(text).model.lowerPositionLimit[0],
        ClosedChain.from_mjcf(text).model.upperPositionLimit[0],
    )
    assert (low, high) == pytest.approx((0.5, 1.7))
    assert data.qpos[0] == pytest.approx(low, abs=2e-3) or data.qpos[0] == pytest.approx(high, abs=2e-3)
    assert abs(data.qvel[0]) < 1e-6
