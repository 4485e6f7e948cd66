"""The face that all results share."""

import dataclasses
import hashlib
import inspect
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import wrist
from exo_pin.core.results import Result, plain


@pytest.fixture(scope="module")
def answers():
    """One of each result that a method of ShoulderExo returns in short time, single and as a stack."""
    exo = ep.load("four-cables")
    three = ep.load("three-linear-actuators")
    one, many = exo.pose(60, 30), exo.pose([0, 30, 60], 30)
    times = np.linspace(0.0, 1.0, 12)
    lift = ep.Movement.from_samples(times, exo.pose(30 * (1 - np.cos(np.pi * times)), 20), smoothing=None)
    found = [exo.remedy(one), exo.follow(lift), exo.check(), three.nearest_singularity(one), exo.workspace(many)]
    for poses in (one, many):
        found += [exo.reaction(poses), exo.reaction_map(poses), exo.inverse_kinematics(poses), exo.singularity(poses)]
        found += [three.forward_kinematics(three.inverse_kinematics(poses).lengths)]
    return [*found, found[5].range(), found[5].optimum, found[5].certificate, found[5].limits]


def test_results_are_plain_data(answers):
    for answer in answers:
        assert isinstance(answer, Result), type(answer)
        data = json.loads(answer.to_json())
        assert data["provenance"]["result"] == type(answer).__name__
        assert data["provenance"]["exo_pin"] == ep.__version__
        assert data["cautions"] == list(answer.cautions)
        assert len(data) > 3
        text = repr(answer)
        assert text.startswith(f"{type(answer).__name__}(")
        assert len(text) <= 1200
        assert "\n" not in text


def test_tables_have_one_row_a_pose(answers):
    pytest.importorskip("pandas")
    exo = ep.load("four-cables")
    for answer in answers:
        answer.to_dataframe()
    stack = exo.pose([[0, 30, 60], [10, 20, 30]], 30)
    state = exo.inverse_kinematics(stack)
    table = state.to_dataframe()
    assert len(table) == state.lengths.size
    np.testing.assert_array_equal(table["lengths"], state.lengths.ravel())
    np.testing.assert_array_equal(table["directions_3"], state.directions[..., 2].ravel())
    singularity = exo.singularity(stack).to_dataframe()
    assert len(singularity) == 6
    assert {"smallest_singular_value", "kind"} <= set(singularity.columns)


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


def test_every_dataclass_that_a_method_returns_is_a_result():
    checked = 0
    for name, method in inspect.getmembers(ep.ShoulderExo, inspect.isfunction):
        for word in str(inspect.signature(method).return_annotation).split(" | "):
            kind = getattr(ep, word.split(".")[-1], None) or getattr(wrist, word.split(".")[-1], None)
            if inspect.isclass(kind) and dataclasses.is_dataclass(kind):
                assert issubclass(kind, Result), name
                checked += 1
    assert checked >= 10


def test_what_a_record_keeps_for_itself_is_no_data():
    @dataclasses.dataclass
    class Kept:
        shown: float
        _memory: np.ndarray

    assert plain(Kept(1.0, np.empty(3))) == {"shown": 1.0}
