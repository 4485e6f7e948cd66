# ruff: noqa: F821
"""What notebook 01 shows holds; run.py runs this in its kernel."""

assert (answer.residual[answer.has_answer] <= 1e-9).all()
assert abs(answer.magnitude - 117.5) < 0.1
assert 15 < answer.percent_body_weight < 17
assert len(motion.crossings()) == 1
assert (answer.actuator_forces < 0).any()
assert answer.certificate.actuator_forces.all()
assert not answer.certificate.shoulder_force.any()
