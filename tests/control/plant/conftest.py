import pytest

import exo_pin as ep


@pytest.fixture(scope="session")
def prototype():
    return ep.load("prototype")


@pytest.fixture(scope="session")
def abducted():
    """An orientation near which the prototype has a stable rest with air in muscles 1 and 3."""
    return ep.thesis_rotation(60.0, -20.0, -15.0, degrees=True)
