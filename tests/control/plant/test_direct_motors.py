"""Motors in joints, one by one, against the formulas of their efforts, friction, brakes and ends."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.control import JointMotor
from exo_pin.control.plant.any_device.direct_motors import DirectMotors, bristle_rates
from exo_pin.control.plant.drives import DirectDrive
from exo_pin.control.plant.equations.drive_kernels import FLOWS

MOTOR = JointMotor(inertia=0.05, viscous=0.3, coulomb=0.4, load_friction=0.1, presliding=2e-3, stall_ratio=3.0,
                   stop_depth=0.02, stop_time=0.01)  # fmt: skip
#: -8 to 10 N m, 4 rad/s, from -1 to 2 rad.
DRIVE = DirectDrive("motor", -1.0, 2.0, 0.0, MOTOR, -8.0, 10.0, 4.0, True)


def motors(drive=DRIVE, place=1):
    tree = pin.buildSampleModelManipulator()
    before = tree.armature.copy()
    found = DirectMotors([drive], [place], tree)
    return found, tree.armature - before


def efforts(found, x=0.0, speed=0.0, sign=1.0, z=0.0, **act):
    row = np.array([[(act | {"intact": act.get("intact", 1.0), "powered": act.get("powered", 1.0)}).get(name, 0.0)
                     for name in FLOWS]])  # fmt: skip
    return [float(value[0]) for value in found.efforts(*(np.array([v]) for v in (x, speed, sign, z)), row)]


@pytest.mark.parametrize(("asked", "speed", "given"), [
    (6.0, 0.0, 6.0), (20.0, 0.0, 10.0), (-20.0, 0.0, -8.0),  # within the limits
    (20.0, 3.0, 7.5), (20.0, 4.0, 0.0), (20.0, 5.0, -7.5), (20.0, 9.0, -8.0),  # of 30 N m at a stall what is left
    (-20.0, -3.0, -7.5), (-20.0, 3.0, -8.0), (-20.0, -4.0, 0.0), (-20.0, -9.0, 10.0),
])  # fmt: skip
def test_an_effort_within_its_limits_and_its_speed(asked, speed, given):
    found, armature = motors()
    tension, source, bends, power = efforts(found, speed=speed, effort=asked)
    assert source == pytest.approx(given)
    assert tension == pytest.approx(given - 0.3 * speed)
    assert power == pytest.approx(0.3 * speed**2)
    assert bends == pytest.approx(speed / 2e-3)
    assert efforts(found, speed=speed, effort=asked, powered=0.0)[1] == 0.0
    assert efforts(found, speed=speed, effort=asked, intact=0.0)[0] == 0.0
    np.testing.assert_allclose(armature, 0.05 * np.eye(len(armature))[1])
    # P = R I² loses at a stall all that the motor draws: torque times the speed without load.
    assert found.copper == pytest.approx(4.0 / 30.0)


def test_dry_friction_grows_with_the_effort_and_the_brake():
    found, _ = motors()
    for z in (-0.5, 0.5):
        tension, source, bends, power = efforts(found, speed=0.2, z=z, effort=5.0, brake=2.0)
        bound = 0.4 + 0.1 * 5.0 + 2.0
        assert (source, bends) == (5.0, pytest.approx(0.2 / 2e-3))  # elastic
        assert tension == pytest.approx(5.0 - 0.3 * 0.2 - bound * z)
        assert power == pytest.approx(0.2 * (0.3 * 0.2 + bound * z))
    # A cable's friction, and its inertia, are no part of it; nor is that of a smooth motor.
    smooth, armature = motors(place="route")
    assert efforts(smooth, speed=0.2, z=0.5, effort=5.0) == [5.0, 5.0, 0.0, 0.0]
    assert not armature.any()


@pytest.mark.parametrize(("x", "rate", "push"), [
    (-1.1, 0.0, 50.0), (-1.1, -1.0, 55.0), (-1.1, 1.0, 45.0), (-1.005, 3.9, 0.0),  # 500 N m/rad, 5 N m s/rad
    (2.02, 0.0, -10.0), (2.02, 1.0, -15.0), (2.02, -3.9, 0.0), (0.5, 3.0, 0.0), (-1.0, -1.0, 0.0),
])  # fmt: skip
def test_elastic_ends_push_back_and_never_pull(x, rate, push):
    found, _ = motors()
    force, power, energy = (float(value[0]) for value in found.stops(np.array([x]), np.array([rate])))
    depth = max(-1.0 - x, x - 2.0, 0.0)
    assert force == pytest.approx(push)
    assert energy == pytest.approx(0.5 * 500.0 * depth**2)
    # What goes in and is not stored is lost.
    assert power == pytest.approx(
        -(push * rate) - (500.0 * depth * rate * (1.0 if x > 2.0 else -1.0)) if depth else 0.0
    )
    for sign in (1.0, -1.0):
        tension, *_, lost = efforts(found, x=x, speed=sign * rate, sign=sign)
        assert tension == pytest.approx(sign * (push - 0.3 * rate))
        assert lost == pytest.approx(power + 0.3 * rate**2)


def test_bristles_are_elastic_slip_and_are_let_go():
    v, z = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0]), np.array([0.7, 0.85, 1.0, 1.2, 1.0, -1.0])
    slipping = np.array([0.0, 0.5, 1.0, 1.0, 0.0, 1.0])
    np.testing.assert_allclose(bristle_rates(v, z, 0.01), (v - slipping * z) / 0.01, atol=1e-12)


def test_commands_of_drives_and_brakes():
    pulls = DirectDrive("cable", 0.1, 2.0, 5.0, JointMotor(brake_effort=3.0), 5.0, 90.0, np.inf, False)
    brake = DirectDrive("brake", -1.0, 2.0, 0.0, JointMotor(brake_effort=3.0), 0.0, 0.0, np.inf, True, 7.0)
    assert [DRIVE.demand(share) for share in (-1.0, -0.5, 0.0, 0.5)] == [-8.0, -4.0, 0.0, 5.0]
    assert [pulls.demand(share) for share in (-0.5, 0.5)] == [-45.0, 45.0]
    assert [(each.pushes, each.force_limit, each.brake_force, each.limits) for each in (DRIVE, pulls, brake)] == [
        (True, 10.0, 0.0, (-8.0, 10.0)), (False, 90.0, 3.0, (5.0, 90.0)), (True, 0.0, 7.0, (-7.0, 7.0)),
    ]  # fmt: skip
    assert [brake.holding(share) for share in (0.0, 0.49, 0.5, 1.0)] == [7.0, 7.0, 0.0, 0.0]
