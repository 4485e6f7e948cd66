"""The command line is tested as its users run it."""

import os

import pytest

from exo_pin.core import compiled

#: What the environment asks for; read before tests set it.
AS_ASKED = os.environ.get("EXO_PIN_COMPILE") or "auto"


@pytest.fixture(autouse=True)
def _as_users_run(_compiled):
    """Leave single poses uncompiled, unless the environment says how to run."""
    with compiled.mode(AS_ASKED):
        yield
