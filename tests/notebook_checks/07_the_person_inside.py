# ruff: noqa: F821
"""What notebook 07 shows holds; run.py runs this in its kernel."""

# The bare arm: the size that is known, and twice of it with 2 kg.
for name, each in alone.items():
    assert (each.status == "ok").all()
    assert 55.0 < each.percent_body_weight[elevation == 90.0][0] < 95.0, name
    ratio = carrying[name].magnitude[5:] / each.magnitude[5:]
    assert ((ratio > 1.8) & (ratio < 2.6)).all()
# What it rests on.
assert assumptions.lowest < bare.magnitude < assumptions.highest
assert 0.8 < assumptions.variants["rotator cuff of 56 %"].magnitude / bare.magnitude < 1.0
least, most = assumptions.band
assert least < bare.percent_body_weight < most
# The device relieves the joint and switches the muscles off.
assert worn.relief_percent > 80.0
assert worn.activations.max() < 0.05 < 0.2 < without.max()
assert (worn.device_forces > -1e-9).all()
# Over the range: medians, and what limbs that only pull can do.
assert np.nanmedian(maps["four-cables"].relief_percent) > 80.0
assert np.nanmedian(maps["prototype"].relief_percent) > 80.0
assert side["limbs only pull"] < 35.0
# Side forces matter where the moments are carried, and only there.
assert side["all moments, side forces up to 20 N"] > side["all moments carried"] + 10.0
assert abs(side["limbs only pull, side forces up to 20 N"] - side["limbs only pull"]) < 5.0
# The moving centre.
assert 36.0 < np.linalg.norm(moved[at]) < 40.0
assert follows.magnitude[at] < 0.2 * follows.without_device.magnitude[at]
assert 0.4 < fixed.magnitude[at] / fixed.without_device.magnitude[at] < 0.7
