"""What the documentation says of the design that a person can wear."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria

SIZES = (ep.Wearer(1.755, 85, "male"), ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
NAMES = ("stroke", "singularity", "connected", "forces", "shoulder_force", "limb_loss", "clearance")
LIMITS = Criteria(
    names=NAMES,
    largest_shoulder_force=250.0,
    least_gap=0.003,
    least_moment_without_limb=0.0,
    wearers=SIZES,
    elbow_range=(0.0, np.radians(130.0)),
)
WITH_ALL = LIMITS.replace(names=tuple(name for name in NAMES if name != "limb_loss"))


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-linear-actuators-worn")


@pytest.fixture(scope="module")
def person():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    return ep.Person(1.755, 85, "male")


@pytest.mark.parametrize("moves", [True, False])
def test_lifts_are_inside_for_everyone(exo, person, moves):
    path, forces = person.centre_path() if moves else None, []
    for poses in (exo.pose(flexion=np.arange(0.0, 91.0, 2.5)), exo.pose(abduction=np.arange(0.0, 91.0, 2.5))):
        lift = exo.workspace(poses, WITH_ALL.off_grid(), centre_offset=path)
        assert lift.inside.all()
        forces.append(lift.magnitude.max())
        # What a limp actuator lacks here is little: the arm sinks.
        failed = exo.workspace(poses, LIMITS.off_grid(), centre_offset=path)
        assert failed.margins["limb_loss"].min() > -2.45
    assert forces == pytest.approx([62.1, 109.1] if moves else [70.0, 98.6], abs=0.1)


@pytest.mark.full
def test_contact_stays_inside_the_socket(exo, person):
    pytest.importorskip("clarabel")
    path = person.centre_path()
    angles = np.meshgrid(np.arange(0, 111, 20.0), np.arange(0, 97, 20.0), np.arange(-20, 86, 20.0), indexing="ij")
    found = exo.workspace(exo.pose(*angles), LIMITS, centre_offset=path)
    assert found.inside.sum() == 140
    contact = exo.joint_contact(found.poses[found.inside], person, centre_offset=path)
    assert (contact.status == "ok").all()
    assert np.median(contact.magnitude) == pytest.approx(29.5, abs=0.2)
    assert np.median(contact.without_device.magnitude) == pytest.approx(444.1, abs=0.5)
