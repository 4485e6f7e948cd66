"""A stroke holds its ends: limbs exactly at their least or greatest length are within it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep


def at_its_end(exo, pose, end, beyond=0.0):
    """The design with strokes that end where its limbs are in a pose, but for a length, m."""
    lengths = exo.inverse_kinematics(pose).lengths
    limbs = []
    for limb, length in zip(exo.limbs, lengths, strict=True):
        stroke = limb.stroke
        nominal = 0.25 * float(length)
        fitting = float(length + beyond - getattr(stroke, end) * nominal)
        limbs.append(replace(limb, stroke=replace(stroke, nominal_length=nominal, end_fitting=fitting)))
    return exo.replace(limbs=limbs)


@pytest.mark.parametrize(("end", "sign"), [("shortest", 1.0), ("longest", -1.0)])
def test_limbs_at_the_end_of_their_stroke_are_within_it(end, sign):
    exo, rng = ep.load("three-linear-actuators"), np.random.default_rng(0)
    for angles in rng.uniform(10.0, 60.0, (40, 3)):
        pose = exo.pose(*angles)
        stack = Rotation.from_quat([[pose.as_quat()]])
        there, past = at_its_end(exo, pose, end), at_its_end(exo, pose, end, sign * 1e-6)
        assert there.workspace(stack, ["stroke"]).inside.all()
        assert not past.workspace(stack, ["stroke"]).inside.any()
        for design, within in ((there, True), (past, False)):
            statuses = design.reaction(pose).status, *design.reaction_map(stack).status.ravel()
            assert [str(each) != "out_of_stroke" for each in statuses] == [within] * 2
            assert ep.study.evaluate(design, pose)["reach"] == float(within)
        if end == "shortest":
            # The rule of the thesis: a pose is lost where all limbs would be too short.
            rule = ep.Criteria(["stroke"], stroke_rule="not all short")
            assert there.workspace(stack, rule).inside.all()
            assert not past.workspace(stack, rule).inside.any()
