# ruff: noqa: F821
"""What the notebook says of the design that a person can wear; run after its last cell, in its names."""

assert answer.can_hold.shape == ()
assert "passes through the wearer" in answer.verdict
assert 0.829 < reached.index < 0.839
assert reached.not_checked.keys() >= {"socket", "cuff_pull"}
assert short.evaluations == 2400
assert 0.85 < short.best_candidate.index < 0.87
assert 0.40 < worn.index < 0.46
assert 0.57 < worn.fractions["limb_loss"] < 0.63
assert worn.fractions["clearance"] < 0.8
assert table["index"].min() > 0.85
lifts = exo.workspace(exo.pose(flexion=np.arange(0, 91, 5)), asked.off_grid(), centre_offset=path)
assert lifts.met["clearance"].all()
assert lifts.met["forces"].all()
assert float(contact.magnitude.max()) < 120.0
assert float(contact.without_device.magnitude.max()) > 400.0
