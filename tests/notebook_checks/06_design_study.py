# ruff: noqa: F821
"""What notebook 06 shows holds; run.py runs this in its kernel."""

again = kept.reaction(poses, **limits)
before = four.reaction(poses, **limits)
# The file holds the very design that was chosen.
np.testing.assert_array_equal(again.shoulder_force, seen[chosen][0].reaction(poses, **limits).shoulder_force)
# A wider torso ring lowers the peak and widens the margin; so does an arm ring that is closer, which holds more, too.
by_size = {name: table[name].reshape(3, 3) for name in figures}  # over r_A and h_B
assert (np.diff(by_size["peak_F_s_N"], axis=0) < 0).all()
assert (np.diff(by_size["peak_F_s_N"], axis=1) > 0).all()
assert (np.diff(by_size["least_margin"], axis=0) > 0).all()
assert (np.diff(by_size["least_margin"], axis=1) < 0).all()
assert (np.diff(by_size["holdable"], axis=1) < 0).all()
# Better on all three than the prototype with three muscles and with the best fourth, and where both hold, too.
for k in range(2):
    assert end["holdable"][1] == 1.0 > start["holdable"][k]
    assert end["peak_F_s_N"][1] < 0.7 * start["peak_F_s_N"][k]
    assert end["least_margin"][1] > 3 * start["least_margin"][k]
assert np.nanmax(again.magnitude[before.has_answer]) < np.nanmax(before.magnitude)
# What holds it pulls, within its strength, balances, and clears the arm.
assert (again.actuator_forces > -1e-6).all()
assert (again.actuator_forces < strength + 1e-6).all()
assert again.is_balanced()
assert (clearances(kept) > needed).all()
assert not (clearances(three) > needed).all()
# It is one that none betters, and what it is not good for is known.
assert front[chosen]
assert fine["holdable"] > 0.95
assert all(row["holdable"] > 0.9 and row["peak_F_s_N"] < start["peak_F_s_N"][1] for row in off.values())
assert (strokes > lengths.max(axis=0)).sum() == 3
