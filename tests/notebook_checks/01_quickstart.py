# ruff: noqa: F821
"""What notebook 01 shows holds; run.py runs this in its kernel."""

assert (answer.residual[answer.has_answer] <= 1e-9).all()
assert answer.can_hold
assert abs(answer.magnitude - 68.3) < 0.1
assert 8 < answer.percent_body_weight < 9
allowed = answer.range()
assert abs(allowed.least - 50.6) < 0.1
assert abs(allowed.greatest - 436.0) < 0.5
assert answer.certificate.undetermined.sum() == 1
assert motion.held.all()
assert motion.magnitude.max() < 75.5
assert not before.held.any()
assert (before.actuator_forces < 0).any(axis=1).mean() > 0.9
assert len(before.crossings()) == 1
