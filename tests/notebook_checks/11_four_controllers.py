# ruff: noqa: F821
"""What notebook 11 says of the four controllers; run after its last cell, in its names."""

mean = {name: float(np.nanmean(found.magnitude)) for name, found in contact.items()}
effort = {name: float(np.nanmean(found.effort)) for name, found in contact.items()}
assert all(run.status == "completed" for run in runs.values())
assert min(mean, key=mean.get) == min(effort, key=effort.get) == "impedance"
assert max(mean.values()) < np.nanmean(bare)
assert runs["model"].summary()["assistance"] > 1.0
assert runs["model"].summary()["wearer_work_J"] < 0.0
