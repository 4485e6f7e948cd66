"""Tables of a workspace: a row a pose, with verdict and reason, read again from the file."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.core.conventions import CLINICAL_ANGLES


def test_rows_have_pose_verdict_and_reason(tmp_path):
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "w.csv"
    assert main(["workspace", "four-linear-actuators-worn", "--step", "60", "--out", str(path)]) == 0
    table = pandas.read_csv(path, keep_default_na=False, na_values={"F_s_N": [""]})
    exo = ep.load("four-linear-actuators-worn")
    poses = exo.pose(*table[list(CLINICAL_ANGLES)].to_numpy().T)
    found = exo.workspace(poses)
    # Of a grid "connected" depends on neighbours, which a row of poses does not have.
    own, others = ([text.replace(", connected", "") for text in texts] for texts in (table["reason"], found.reasons))
    assert own == others
    np.testing.assert_allclose(table["F_s_N"], found.magnitude, rtol=1e-6, atol=1e-6)
    assert all(name.isidentifier() for name in table.columns)
    assert set(table["verdict"]) == {"inside", "outside"}
    assert ((table["verdict"] == "inside") == (table["reason"] == "")).all()
