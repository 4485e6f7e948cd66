# ruff: noqa: F821
"""What notebook 03 shows holds; run.py runs this in its kernel."""

spherical, minimal, elastic, standalone = answers.values()
cables = sps.reaction(pose)

# Cables are determined and equal the UPU mechanism with g = 0.
assert cables.certificate.shoulder_force.all()
np.testing.assert_allclose(cables.shoulder_force, spherical.shoulder_force, rtol=1e-9)
# Limb forces do not depend on the assumption; the shoulder force does.
for answer in answers.values():
    tolerance = 0.1 if answer is elastic else 1e-9  # displaced lever arms
    np.testing.assert_allclose(answer.actuator_forces, cables.actuator_forces, rtol=tolerance)
    assert not answer.certificate.shoulder_force.any()
assert standalone.magnitude < 1e-9 < minimal.magnitude < spherical.magnitude
# The limits of the elastic answer.
assert 0.8 * force[-1] < min(force) < 0.9 * force[-1] < force[-1] < force[0]
assert np.isfinite(force).all()
soft = guided.replace(shoulder=ep.Shoulder(stiffness=4.3e3)).reaction(pose, split="elastic")
assert soft.status == "no_equilibrium"
assert abs(force[-1] - cables.magnitude) < 0.01 * cables.magnitude
# A centimetre off.
assert tubes[4] > 1.8 * tubes[0]
assert muscles[4] < 1.1 * muscles[0]
