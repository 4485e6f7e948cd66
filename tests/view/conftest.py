"""Fixtures of the viewer's tests."""

import pytest
from scenes import PERSON

import exo_pin as ep
from exo_pin.view.scene import human_figure as human_module


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(PERSON)


@pytest.fixture
def no_human(monkeypatch):
    monkeypatch.setattr(human_module, "_shares", lambda: iter(()))
