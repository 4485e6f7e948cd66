# ruff: noqa: F821
"""What notebook 05 shows holds; run.py runs this in its kernel."""

# From points: consistent, and the pulls that were found pull, balance, and beat the shortest tensions.
assert mine.check().passed
held = pulls.held
assert held.any()
assert (pulls.actuator_forces[held] > -1e-9).all()
assert (pulls.residual[pulls.has_answer] <= 1e-9).all()
# From a file: the same bits.
np.testing.assert_array_equal(again.reaction(pose).shoulder_force, free.shoulder_force)
# From a URDF: the same forces, and the loops close.
expected = prototype.reaction(pose).shoulder_force
np.testing.assert_allclose(robot.reaction(pose).shoulder_force, expected, rtol=1e-8)
assert robot.check().passed
# A four-bar has one freedom.
assert four_bar.mobility(q).degrees_of_freedom == 1
assert np.abs(four_bar.residual(q)).max() < 1e-10
assert np.abs(four_bar.residual(scene.q)).max() < 1e-10
