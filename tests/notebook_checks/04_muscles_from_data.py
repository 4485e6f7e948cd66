# ruff: noqa: F821
"""What notebook 04 shows holds; run.py runs this in its kernel."""

# The region agrees with the thesis but for two cells, and contains all of its 25.
assert both == states.called_valid.sum() == 25
assert region.selected.sum() == 27
# The refit's forces are as good as the print's; its coefficients are not to be compared.
printed_error = muscle_model("tang-optimised").unchecked_force(valid.contraction, valid.pressure) - valid.force
assert np.sqrt(np.mean(printed_error**2)) < 0.45
assert found.rms < 0.6
assert set(found.indistinct) == set(found.names)
# The chosen form foretells better, at measurements that it was not fitted to.
assert form.leave_one_out_rms < 0.7 * thesis_form.leave_one_out_rms
np.testing.assert_allclose(best.unchecked_force(0.05, 3 * BAR), form.model.unchecked_force(0.05, 3 * BAR), rtol=0.02)
# Friction: a loop, and no energy made of nothing.
assert np.interp(18.0, motion.time, motion.contraction) > np.interp(6.0, motion.time, motion.contraction) + 5e-3
assert motion.friction_loss > 0
# Pressure and force undo each other.
there = muscle.pressure_for(30.0, 0.270)
np.testing.assert_allclose(muscle.model.force(muscle.contraction(0.270), there), 30.0, rtol=1e-9)
# Strokes rule the prototype out; the fourth muscle is what forces need.
assert (needed > lengths.max()).all()
assert reached < 0.01
assert max(held["3, device alone"][-1], held["3, with an arm"][-1]) < 0.02
assert held["4, with an arm"][0] < 0.05 < 0.5 < held["4, with an arm"][2]
assert held["4, device alone"][0] > 0.6
