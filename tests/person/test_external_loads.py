"""External loads as OpenSim applies them, where it is installed."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.person import write_external_loads

TIMES = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def followed():
    movement = ep.Movement.from_samples(TIMES, ep.shoulder_rotation(30 * TIMES, 20, 0, degrees=True))
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    return exo.follow(movement, static=True).reaction


def test_opensim_applies_them_to_the_humerus(tmp_path, followed, monkeypatch):
    monkeypatch.chdir(tmp_path)  # OpenSim writes a log where it is imported
    osim = pytest.importorskip("opensim", reason="a check with OpenSim: pip install opensim")
    xml, _ = write_external_loads(tmp_path / "device.xml", TIMES, followed.cuff_wrench)
    model = osim.Model()
    body = osim.Body("humerus", 1.0, osim.Vec3(0), osim.Inertia(1.0))
    model.addBody(body)
    model.addJoint(osim.FreeJoint("free", model.getGround(), body))
    loads = osim.ExternalLoads(str(xml), True)
    loads.setDataFileName(str(tmp_path / "device.sto"))
    model.addModelComponent(loads)
    state = model.initSystem()
    state.setTime(0.5)
    model.realizeDynamics(state)
    force = osim.ExternalForce.safeDownCast(loads.get(0))
    at = [force.getForceAtTime(0.5).get(k) for k in range(3)]
    torque = [force.getTorqueAtTime(0.5).get(k) for k in range(3)]
    cuff = followed.cuff_wrench[5]
    assert at == pytest.approx([cuff[0], cuff[2], -cuff[1]], rel=1e-9)
    assert torque == pytest.approx([cuff[3], cuff[5], -cuff[4]], rel=1e-9)
    assert force.getAppliedToBodyName().endswith("humerus")
