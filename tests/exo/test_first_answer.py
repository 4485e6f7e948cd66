"""The first answer to a question about one pose: its size, and its numbers, names and counts read back."""

import re

import numpy as np
import pytest
from first_answers import NUMBERS, device_and_pose, read_back

import exo_pin as ep
from exo_pin.cli import main

#: What a clinician would have to look up.
TERMS = re.compile(r"\bF_s\b|\bg\b|split|\bnan\b|\binf\b|_|certificate|null ?space|reaction(s|\b)|wrench", re.I)


@pytest.mark.parametrize("seed", range(NUMBERS))
def test_drawn_first_answers_are_read_back(seed):
    report = device_and_pose(seed)
    assert read_back(report) == []
