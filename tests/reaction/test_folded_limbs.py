"""Limbs that point at the shoulder's centre: which of them a pose can do without."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import (
    exo_of,
    heavy_limbs,
    map_of,
    random_mechanism,
)

import exo_pin as ep


def test_folded_cable_beside_others_is_answered():
    """A cable that points at O only loses its moment arm: the other four hold the pose."""
    rng = np.random.default_rng(60)
    base = rng.normal(size=(5, 3)) * 0.1 + [0, -0.1, 0.05]
    platform = rng.normal(size=(5, 3)) * 0.08 + [0, 0.02, -0.2]
    base[0], platform[0] = [0, 0, -0.1], [0, 0, -0.2]
    tilt = Rotation.from_rotvec([0.3, 0.2, 0.1])
    arm = random_mechanism(rng, 3).arm
    cables = ep.ShoulderExo(ep.WristGeometry(base, platform, neutral=tilt), arm, [ep.Limb("SPS")] * 5)
    poses = Rotation.from_euler("X", [[0.0], [10.0]], degrees=True)
    answer, closed = cables.reaction(poses), map_of(cables.mechanism, poses)
    assert answer.status.tolist() == closed.status.tolist() == ["ok", "ok"]
    np.testing.assert_allclose(answer.shoulder_force, closed.shoulder_force, rtol=1e-9)
    np.testing.assert_allclose(answer.actuator_forces, closed.actuator_forces, rtol=1e-9, atol=1e-9)
    assert answer.actuator_forces[0, 0] == pytest.approx(0, abs=1e-12)
    heavy = exo_of(heavy_limbs(cables.mechanism, rng)).reaction(poses)
    assert (heavy.status == "ok").all()
    assert heavy.residual.max() < 1e-9


@pytest.mark.parametrize("split", ["spherical", "minimal", "standalone"])
def test_folded_cable_beside_upu_limbs_is_answered(split):
    """It has no side force and needs no plane, so the UPU limbs hold the pose, by every way of asking."""
    rng = np.random.default_rng(69)
    base = rng.normal(size=(5, 3)) * 0.1 + [0, -0.1, 0.05]
    platform = rng.normal(size=(5, 3)) * 0.08 + [0, 0.02, -0.2]
    base[0], platform[0] = [0, 0, -0.1], [0, 0, -0.2]
    guide = ep.LimbGuide(50.0, 30.0)
    kinds = [ep.Limb("SPS")] + [ep.Limb(guide=guide)] * 3 + [ep.Limb("SPS")]
    geometry = ep.WristGeometry(base, platform, neutral=Rotation.from_rotvec([0.3, 0.2, 0.1]))
    exo = ep.ShoulderExo(geometry, random_mechanism(rng, 3).arm, kinds, ep.Shoulder(stiffness=2e4))
    folded, beside = Rotation.identity(), Rotation.from_rotvec([1e-6, -2e-6, 0])
    bounds = (-5.0, 8.0) if split == "minimal" else None
    answer, near = (exo.reaction(pose, split=split, constraint_bounds=bounds) for pose in (folded, beside))
    assert answer.status == near.status == "ok"
    assert answer.residual < 1e-9
    mapped = exo.reaction_map(folded, split=split, constraint_bounds=bounds)
    off = exo.reaction(folded, split=split, constraint_bounds=bounds, centre_offset=np.zeros(3))
    assert mapped.status == off.status == "ok"
    for other, tolerance in ((mapped, 1e-7), (off, 1e-7), (near, 1e-2)):
        np.testing.assert_allclose(answer.shoulder_force, other.shoulder_force, atol=tolerance)
    if split == "spherical":
        assert answer.actuator_forces[0] == pytest.approx(0, abs=1e-9)
    assert exo.singularity(folded).kind == "regular"
    # A UPU limb in the same place has no plane, and nobody can say which way it pushes.
    stiff = exo.replace(limbs=(ep.Limb(guide=guide), *kinds[1:]))
    assert stiff.reaction(folded, split=split, constraint_bounds=bounds).status == "folded"
    assert stiff.reaction_map(folded, split=split, constraint_bounds=bounds).status == "folded"
    assert stiff.singularity(folded).kind == "folded"
