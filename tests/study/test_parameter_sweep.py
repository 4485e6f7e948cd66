"""Design studies: tables against single queries, and two processes."""

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from wrists import map_of

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.study import StudyTable, adl_box

PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


@pytest.mark.full
def test_what_three_pulling_muscles_of_the_prototype_hold(prototype):
    """1.8 % of the 2° grid with the moving part alone: by the closed form's signs and by the exact moment set."""
    poses = adl_box(2.0)
    assert poses.shape == (56, 51, 53)
    tensions = map_of(prototype.mechanism, poses).actuator_forces
    held = (tensions >= 0).all(axis=-1)
    assert round(100 * held.mean(), 1) == 1.8
    rest = map_of(prototype.mechanism, ep.shoulder_rotation(0, 0, 0)).actuator_forces
    np.testing.assert_allclose(rest, [-1.3, -4.0, -6.2], atol=0.05)


def test_a_sweep_is_its_single_queries(prototype):
    exo, poses = prototype.worn_by(PERSON), adl_box(25.0)
    values = {"r_A": [0.12, 0.14], "lean_forward": [0.0, 0.4]}
    table, free = ep.sweep(exo, values, poses), ep.sweep(exo, values, poses, limits="none")
    assert table.row_count == 4
    for row in range(4):
        geometry = exo.geometry.replace(r_A=table["r_A"][row])
        angle = table["lean_forward"][row]
        gravity = 9.81 * np.array([np.sin(angle), 0, -np.cos(angle)])  # leaning forward, down is forward of the trunk
        design = exo.replace(geometry=geometry, gravity=gravity)
        assert table["holdable"][row] == design.reaction(poses).held.mean() == 0.0
        assert np.isnan(table["peak_F_s_N"][row])
        force = free["peak_F_s_N"][row], free["median_F_s_N"][row]
        sizes = design.reaction(poses, limits="none").magnitude
        assert force == pytest.approx((sizes.max(), np.median(sizes)), rel=1e-6)
        state = design.singularity(poses)
        assert table["one_side"][row] == max((state.determinant > 0).mean(), (state.determinant < 0).mean())
    assert (table["error"] == "").all()


def test_pandas_is_optional(prototype, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(errors.MissingExtra, match=r"\.\[study\]"):
        StudyTable([{"a": 1.0}]).to_dataframe()


@pytest.mark.full
def test_two_processes_give_the_same_table(prototype):
    parameters = {"r_A": [0.12, 0.13, 0.14], "limb_kind": ["UPU", "SPS"]}
    poses = adl_box(50.0)
    one = ep.sweep(prototype, parameters, poses)
    local = type("Local", (), {"force_limits": staticmethod(lambda length: (0.0 * length, 400.0 + 0.0 * length))})
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        two = ep.sweep(prototype, parameters, poses, executor=pool)
        with pytest.raises(ep.InvalidInput, match="another process"):
            ep.sweep(prototype, parameters, poses, executor=pool, limits=local())
    for name in one:
        np.testing.assert_array_equal(one[name], two[name])
