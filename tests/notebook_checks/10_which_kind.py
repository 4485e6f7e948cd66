# ruff: noqa: F821
"""What notebook 10 says of the kinds of devices; run after its last cell, in its names."""

assert len(devices) == 6
assert max(contact[label] for label in held) < 0.25 * bare
assert 0.4 * bare < contact["passive spring"] < 0.7 * bare
assert [label for label in devices if np.isnan(rigid[label])] == ["spherical 3RRR", "three motors in series"]
assert shown["three motors in series"] > 3 * max(each for each in rigid.values() if not np.isnan(each))
assert box.shape == (4, 4, 4)
assert failed["four linear actuators"] > 0.8
assert all(failed[label] == 0.0 for label in ("spherical 3RRR", "3RPS, sliding ball", "three motors in series"))
