# ruff: noqa: F821
"""What notebook 06 shows holds; run.py runs this in its kernel."""

# The prototype: singular near rest, and hardly anything for limbs that only pull.
assert abs(rest) < 0.05
assert 0.3 < across < 0.45
assert held["pull"].index < 0.02
assert held["pull and push"].index > 0.5
# Every further demand costs something or nothing, and never gives.
assert (np.diff(list(cost.values())) <= 0.0).all()
# The design lifts to 90° both ways, on most of the range.
assert check.works
assert reached.index > 0.855
assert np.nanmax(check.flexion.magnitude) < 82.0
assert np.nanmax(check.abduction.magnitude) < 49.0
assert min(check.persons.values()) > 0.81
assert min(check.offsets.values()) > 0.85
# It pulls only, and stays well below what the drives can do.
assert reached.tensions[reached.inside].min() > 5.0 - 1e-6
assert reached.tensions[reached.inside].max() < 152.0
# The other families, with all criteria on.
assert results["four-linear-actuators"].index > 0.98
assert results["three-linear-actuators"].index > 0.905
assert results["four-muscle-cables"].index > 0.80
for each in results.values():
    assert each.one_by_one()["together"][-1] == each.index
assert work["force_from_N"].min() > -330.0
assert work["arm_tilt_deg"].max() < 62.0
