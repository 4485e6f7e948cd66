# ruff: noqa: F821
"""What notebook 08 shows holds; run.py runs this in its kernel."""

# Abduction from beyond the singular pose stops by the stroke; nothing of it can be held.
assert 55.0 < tracking.summary()["end_deg"] < 75.0
assert not tracking.reachable.any()
assert any("runs out of stroke" in text for text in tracking.findings)
# These estimates move the end by a few degrees.
assert max(abs(end - ends["as estimated"]) for end in ends.values()) < 8.0
# The model-based controller is better by far where the muscles can hold the pose.
assert runs["pi"].rms_error() > 5.0 * runs["model"].rms_error()
assert np.degrees(runs["model"].rms_error()) < 3.0
assert ep.experiment("abduction-long").run().summary()["end_deg"] > 80.0
# Winches carry a man's arm to 90 degrees.
assert np.degrees(cables.rms_error()) < 0.5
assert cables.reachable.all()
assert ep.experiment("abduction-flange").run().summary()["end_deg"] < 65.0
