"""An answer has all that is needed to compute it again."""

import hashlib
import json

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep


def test_an_answer_has_all_that_is_needed_to_compute_it_again(tmp_path):
    exo = ep.load("four-cables")
    load = ep.Load([0.0, 0.0, -12.0], at=[0.0, 0.0, -0.3], frame="arm")
    answer = exo.reaction(exo.pose([20, 60], 30), load=load, split="minimal", limits=(5.0, np.inf))
    path = tmp_path / "design.toml"
    exo.save(path)
    data = json.loads(answer.to_json())["provenance"]
    assert data["design"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    case, assumed = data["case"], data["assumptions"]
    again = ep.load(path).reaction(
        Rotation.from_quat(case["poses"]["quaternions_xyzw"]),
        load=ep.Load(**case["load"]),
        split=assumed["split"],
        limits=tuple(np.inf if end is None else end for end in assumed["limits"]),
    )
    np.testing.assert_allclose(again.shoulder_force, answer.shoulder_force, rtol=1e-12, atol=1e-10)
