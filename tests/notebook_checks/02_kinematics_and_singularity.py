# ruff: noqa: F821
"""What notebook 02 shows holds; run.py runs this in its kernel."""

# Every way back finds the pose; only all six angles leave no doubt.
for modes in ways.values():
    assert (modes.nearest_rotations * pose.inv()).magnitude() < 1e-10
assert [int(modes.count) for modes in ways.values()] == [4, 4, 2, 1]
# Eight poses, all of them with the same lengths.
assert most == {"prototype": 6, "optimised-table-5-3": 8, "optimised-table-c-2": 8}
again = eight.inverse_kinematics(all_of_them.rotations).lengths
np.testing.assert_allclose(again, again[:1].repeat(8, axis=0), atol=1e-10)
# Modes meet where det X is zero, 6.21° from rest, and Pinocchio agrees.
assert abs(crossing - 6.21) < 0.13
assert np.abs(abduction[path.ambiguous] - crossing).min() < 0.13
assert ranks == {30: 18, 90: 17}
assert np.sort(away, axis=-1)[abduction > 6.5, 1].max() < 10
# Rest is a few degrees from the surface, and a good part of daily life lies behind it.
assert nearest.degrees[0] < crossing
assert 0.3 < crossed[0].across < 0.45
