"""The published effect of an offset."""

import json

import numpy as np
import pytest
from command_line import run


@pytest.mark.full
def test_published_effect_of_an_offset(capsys):
    status, out, _ = run(
        capsys, "reaction", "prototype", "--compare", "spherical", "--offset", "0", "0", "20", "--json"
    )
    assert status == 0
    data = json.loads(out)
    assert data["centre_offset_mm"] == [0, 0, 20]
    np.testing.assert_allclose(data["spherical"]["actuator_forces"], [-2.26, 114.73, 113.16], atol=0.005)
    status, out, _ = run(capsys, "reaction", "prototype", "--offset", "0", "0", "-20", "--explain")
    assert "off the shoulder's by (0, 0, -20) mm" in out
    assert "Force of the shoulder on the arm: 11.8 N" in out
