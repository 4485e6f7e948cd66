"""What is read of MJCF, field by field."""

import mujoco
import numpy as np
import pytest
from mjcf_arm import arm, read

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain


@pytest.mark.parametrize(
    ("ja", "actuators", "limits"),
    [
        ("", "", (-np.inf, np.inf)),
        ('actuatorfrcrange="-3 4"', "", (-3, 4)),
        ("", '<motor joint="ja"/>', (-np.inf, np.inf)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2"/>', (-10, 20)),
        ("", '<motor joint="ja" gear="-10" ctrlrange="-1 2"/>', (-20, 10)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2" forcerange="-0.5 0.3"/>', (-5, 3)),
        ('actuatorfrcrange="-3 4"', '<motor joint="ja" gear="10" ctrlrange="-1 0.1"/>', (-3, 1)),
        ("", '<general joint="ja" gainprm="3" ctrlrange="-1 2"/>', (-3, 6)),
        # The control of an actuator with dynamics does not bound its force.
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2"/>', (-np.inf, np.inf)),
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2" forcerange="-7 8"/>', (-7, 8)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja" gear="2" forcerange="-1 1"/>', (-3, 4)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja"/>', (-np.inf, np.inf)),
    ],
)
def test_efforts_are_limited_as_mujoco_limits_them(ja, actuators, limits):
    text = arm(ja=ja, more=f"<actuator>{actuators}</actuator>")
    chain = ClosedChain.from_mjcf(text)
    assert (chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]) == limits
    np.testing.assert_array_equal(chain.model.upperEffortLimit[1:], np.inf)
    assert chain.roles.actuated == (("ja",) if actuators else ())
    # Whatever the controls, MuJoCo's forces stay within, and they come near to the limits.
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    forces = []
    for control in (-1e6, 0.0, 1e6):
        data.ctrl[:] = control * np.sign(model.actuator_gear[:, 0])
        data.act[:] = control
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_actuator[0])
    for limit, force in zip(limits, (min(forces), max(forces)), strict=True):
        if actuators:
            assert force == limit if np.isfinite(limit) else abs(force) > 1e5


def test_mujocos_warnings_become_pythons_and_no_log_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    with pytest.warns(RuntimeWarning, match="NaN"):
        chain = read(ina='<site name="mark" rgba="nan 0 0 1"/>')
    assert np.isfinite(chain.placement(chain.neutral(), "mark").translation).all()
    assert mujoco.get_mju_user_warning() is before
    assert list(tmp_path.iterdir()) == []


def test_physics_that_is_not_known_is_noticed(monkeypatch):
    # As if this package did not know dampers.
    monkeypatch.setattr("exo_pin.chain.structure.passive.PassiveForces.force", lambda *_: np.zeros(5))
    assert read().model.nv == 5
    with pytest.raises(FileFormatError, match="MuJoCo computes other passive forces"):
        read(ja='damping="1"')
