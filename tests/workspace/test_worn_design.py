"""What the documentation says of the design that a person can wear."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria, limb_loss, limb_table

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
@pytest.mark.parametrize(("moves", "whole", "failed"), [(True, 0.887, 0.834), (False, 0.885, 0.833)])
def test_shares_of_the_daily_box(exo, person, moves, whole, failed):
    path = person.centre_path() if moves else None
    assert exo.workspace(criteria=WITH_ALL, centre_offset=path).index == pytest.approx(whole, abs=6e-4)
    found = exo.workspace(criteria=LIMITS, centre_offset=path)
    assert found.index == pytest.approx(failed, abs=6e-4)
    # In one region but for a few poses.
    assert found.region.sum() > 0.99 * found.inside.sum()
    assert limb_table(exo.mechanism, found)["gap_arm_m"].min() >= 0.003


@pytest.mark.full
def test_what_one_failure_leaves(exo, person):
    found = exo.workspace(criteria=WITH_ALL, centre_offset=person.centre_path())
    left = limb_loss(exo.mechanism, found)
    assert left["held"].min() == pytest.approx(0.973, abs=6e-4)
    assert left["held"].max() == pytest.approx(0.992, abs=6e-4)
    assert left["missing_share"].max() < 0.43
    assert left["missing_Nm"].max() < 4.7
    assert left["shoulder_force_N"].max() < 660.0


def test_the_cuff_ends_above_every_elbow(exo):
    lowest = -exo.geometry.platform_points[:, 2].min()
    elbows = [275.1e-3 * 1.525 / 1.735, 281.7e-3 * 1.755 / 1.741]
    assert lowest == pytest.approx(0.142)
    assert min(elbows) - lowest == pytest.approx(0.0998, abs=1e-3)


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
