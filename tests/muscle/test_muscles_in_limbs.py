"""Real muscles in a wrist: which pressures hold an arm."""

import numpy as np

import exo_pin as ep
from exo_pin.muscle import Muscle, muscle_model


def test_muscles_hold_the_device_and_pressures_give_the_required_forces():
    """The prototype with its fourth muscle mounted (base hole 100°, arm hole 280°), each muscle contracted by 20 %."""
    exo = ep.load("prototype")
    base, platform = np.radians([31.3, 59.6, 119.8, 100.0]), np.radians([31.3, 59.6, 119.8, 280.0])
    geometry = exo.geometry.replace(alpha_A=base, alpha_B=platform)
    exo = exo.replace(geometry=geometry, limbs=[ep.Limb("SPS")] * 4)
    pose = ep.shoulder_rotation(60, 60, 0, degrees=True)
    lengths = exo.inverse_kinematics(pose).lengths
    muscles = [
        Muscle(
            model=muscle_model("best").scaled(0.8 * float(length)),
            end_fitting=(1 - 0.8 * 0.8) * float(length),
            least_pressure=1.3e5,
        )
        for length in lengths
    ]
    answer = exo.reaction(pose, split="minimal", limits=muscles)
    assert answer.status == "ok"
    for muscle, length, force in zip(muscles, lengths, answer.actuator_forces, strict=True):
        low, high = muscle.force_limits(length)
        assert low - 1e-6 <= force <= high + 1e-6
        pressure = muscle.pressure_for(np.clip(force, low, high), length)
        assert 1.3e5 * (1 - 1e-9) <= pressure <= muscle.supply * (1 + 1e-9)
        pull = muscle.model.unchecked_force(muscle.contraction(length), pressure)
        np.testing.assert_allclose(pull, force, rtol=1e-6, atol=1e-6)
