"""Arms: the prototype's moving part, sums of bodies, a person's arm."""

import dataclasses

import numpy as np
import pytest

from exo_pin import InvalidInput, MissingData
from exo_pin.design import (
    Arm,
    preset,
)


def test_inertia_of_table_5_4():
    arm = preset("prototype").arm
    np.testing.assert_allclose(np.linalg.eigvalsh(arm.inertia), [0.00107, 0.00390, 0.00402], atol=6e-6)
    printed = [
        [27867611.9, -21184.2, 319504.5],
        [-21184.2, 27638169.9, -2649709.2],
        [319504.5, -2649709.3, 1419768.2],
    ]
    # Read as a tensor, no body can have it.
    with pytest.raises(InvalidInput, match="negative"):
        Arm.from_inertia_about_origin(0.65656, [-0.0026, 0.0227, -0.1897], np.array(printed) * 1e-9)


def test_arms_add_as_bodies_do():
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(40, 3)) * 0.1, rng.random(40)

    def body(selection, device=False):
        m, p = masses[selection], points[selection]
        about_origin = sum(w * (x @ x * np.eye(3) - np.outer(x, x)) for w, x in zip(m, p, strict=True))
        return Arm.from_inertia_about_origin(m.sum(), m @ p / m.sum(), about_origin, device=device)

    total = body(slice(0, 15)) + body(slice(15, 40), device=True)
    whole = body(slice(0, 40))
    assert total.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(total.centre_of_mass, whole.centre_of_mass, atol=1e-15)
    np.testing.assert_allclose(total.inertia, whole.inertia, atol=1e-15)
    assert total.person.mass == pytest.approx(masses[:15].sum())
    assert not total.device
    assert (total + Arm(1.0, [0, 0, 0])).inertia is None
    with pytest.raises(MissingData):
        _ = Arm(1.0, [0, 0, 0]).inertia_about_origin


def test_a_changed_arm_is_a_body_of_its_own():
    person = Arm.from_anthropometry(1.75, 75, "male")
    device = preset("prototype").arm
    heavier = dataclasses.replace(person, mass=6.0)
    assert heavier.person.mass == 6.0
    assert (heavier + device).mass == pytest.approx(6.0 + device.mass)
    assert heavier.mirrored().mass == 6.0
    assert dataclasses.replace(person + device, mass=9.0).parts[0].mass == 9.0


def test_arm_of_a_person():
    arm = Arm.from_anthropometry(1.741, 73.0, "male")
    # The table's own person: 4.94 % of body mass; lengths 281.7, 268.9 and 86.2 mm.
    assert arm.mass == pytest.approx(0.0494 * 73.0)
    assert arm.body_mass == 73.0
    by_hand = (
        -(0.0271 * 0.5772 * 0.2817 + 0.0162 * (0.2817 + 0.4574 * 0.2689) + 0.0061 * (0.2817 + 0.2689 + 0.79 * 0.0862))
        / 0.0494
    )
    np.testing.assert_allclose(arm.centre_of_mass, [0, 0, by_hand], atol=1e-12)
    bent = Arm.from_anthropometry(1.741, 73.0, "male", elbow_flexion=90, degrees=True)
    assert bent.centre_of_mass[0] > 0.05
    assert bent.centre_of_mass[2] > arm.centre_of_mass[2]
    loaded = Arm.from_anthropometry(1.741, 73.0, "male", payload=1.0)
    moved = loaded.mass * loaded.centre_of_mass[2] - arm.mass * arm.centre_of_mass[2]
    assert moved == pytest.approx(-(0.2817 + 0.2689 + 0.0862))
