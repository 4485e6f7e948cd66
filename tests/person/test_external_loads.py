"""External loads for OpenSim: written, read back, and loaded by OpenSim where it is installed."""

import xml.etree.ElementTree as ET

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


def table_of(sto):
    lines = sto.read_text().splitlines()
    start = lines.index("endheader") + 1
    header = dict(line.split("=") for line in lines[1 : start - 1])
    names = lines[start].split("\t")
    values = np.array([[float(cell) for cell in line.split("\t")] for line in lines[start + 1 :]])
    assert (int(header["nRows"]), int(header["nColumns"])) == values.shape
    return dict(zip(names, values.T, strict=True))


def test_wrenches_are_turned_into_opensims_axes(tmp_path, followed):
    centre = (-0.02, 0.01, 0.17)
    xml, sto = write_external_loads(
        tmp_path / "device.xml", TIMES, followed.cuff_wrench, followed.harness_wrench, centre_in_torso=centre
    )
    table = table_of(sto)
    assert np.array_equal(table["time"], TIMES)
    cuff = followed.cuff_wrench
    for name, column, sign in (("x", 0, 1), ("y", 2, 1), ("z", 1, -1)):
        assert np.array_equal(table[f"cuff_force_v{name}"], sign * cuff[:, column])
        assert np.array_equal(table[f"cuff_torque_{name}"], sign * cuff[:, 3 + column])
        assert not table[f"cuff_force_p{name}"].any()
    assert table["harness_force_pz"][0] == 0.17
    forces = ET.parse(xml).getroot().findall(".//ExternalForce")
    assert [force.findtext("applied_to_body") for force in forces] == ["humerus", "thorax"]
    assert ET.parse(xml).getroot().findtext(".//datafile") == "device.sto"


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
