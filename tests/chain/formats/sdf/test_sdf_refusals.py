"""What of SDF is read, left out by name, or refused by name."""

import warnings

import numpy as np
import pinocchio as pin
import pytest
from sdf_arm import ARM
from sdf_mutations import mutated_sdf
from sdf_oracle import DrakeSdf

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain


def read(old="", new="", text=ARM):
    assert old in text
    return ClosedChain.from_sdf(text.replace(old, new, 1) if old else text)


@pytest.mark.parametrize(
    ("geometry", "mass", "moments"),
    [
        ("<box><size>1 2 3</size></box>", 6000.0, np.array([13, 10, 5]) * 500.0),
        ("<sphere><radius>0.5</radius></sphere>", 1000 * np.pi / 6, np.full(3, 100 * np.pi / 6)),
        (
            "<cylinder><radius>0.5</radius><length>2</length></cylinder>",
            500 * np.pi,
            np.array([0.25 / 4 + 4 / 12, 0.25 / 4 + 4 / 12, 0.125]) * 500 * np.pi,
        ),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", 8000 * np.pi, np.array([13, 10, 5]) * 1600 * np.pi),
    ],
)
def test_inertia_of_the_collision_shapes(geometry, mass, moments):
    shape = f'<collision name="c"><pose>1 0 0 0 0 0</pose><geometry>{geometry}</geometry></collision>'
    for inertial, share in (
        ('<inertial auto="true"/>', 1.0), ('<inertial auto="true"><density>500</density></inertial>', 0.5),
        ('<inertial auto="true"><mass>3</mass></inertial>', 3.0 / mass),
    ):  # fmt: skip
        link = f'<link name="base"/><link name="core">{shape}{inertial}</link>'
        own = read('<link name="base"/>', link).model.inertias[-1]
        assert own.mass == pytest.approx(share * mass)
        np.testing.assert_allclose(own.lever, [1, 0, 0])
        np.testing.assert_allclose(own.inertia, share * np.diag(moments), rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    "seeds", [range(60), *(pytest.param(range(k, k + 200), marks=pytest.mark.full) for k in range(60, 2000, 200))]
)
def test_a_mutated_file_means_what_drake_reads_or_is_refused(seeds):
    read = 0
    for seed in seeds:
        text = mutated_sdf(seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                chain = ClosedChain.from_sdf(text)
            except FileFormatError:
                continue
        read += 1
        model = chain.model
        names = [frame.name.split("::")[-1] for frame in model.frames]
        if len(set(names)) < len(names):
            continue  # Drake's names cannot be told apart
        if not model.nv or any(closure.name.endswith("_closure") for closure in chain.closures):
            continue
        try:
            drake = DrakeSdf(text, chain)
        except RuntimeError:
            continue  # Drake refuses some that have a meaning, as a ball joint from the child to the parent
        q = pin.integrate(model, chain.neutral(), np.random.default_rng(seed).uniform(-1.0, 1.0, model.nv))
        M, _ = drake.mass_and_gravity(q)
        upper = np.triu(np.reshape(pin.crba(model, model.createData(), q), (model.nv, model.nv)))
        np.testing.assert_allclose(
            upper + np.triu(upper, 1).T, M, rtol=0, atol=1e-9 * np.abs(M).max(), err_msg=str(seed)
        )
    assert read > len(seeds) / 5
