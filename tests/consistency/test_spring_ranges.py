"""The elevations that the laws of a device's springs cover, by the law of cosines."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import Route, Spring, TableLaw

BELOW, ON_ARM = 0.4, 0.2
WAY = Route.over(("universe", (0.0, 0.0, -BELOW)), ("arm", (0.0, 0.0, -ON_ARM)))


def length(degrees):
    return float(np.sqrt(BELOW**2 + ON_ARM**2 - 2.0 * BELOW * ON_ARM * np.cos(np.radians(degrees))))


def strut(low, high, name="strut"):
    return Spring(name, TableLaw((length(low), length(high)), (-9.0, -5.0)), route=WAY)


def springs_of(exo):
    (found,) = (each for each in exo.check().findings if each.name == "springs")
    return found


@pytest.mark.parametrize("seed", range(4))
def test_ends_at_random(seed):
    # Found to a tenth of a degree, inside, an end is rounded as it is.
    low, high = np.add(np.sort(np.random.default_rng(seed).uniform(5.0, 175.0, 2)).round(), [0.4, 0.6])
    exo = ep.load(URDF / "serial-y-x-z.urdf").replace(springs=[strut(low, high)])
    assert springs_of(exo).detail.startswith(f"spring 'strut': law covers {low:.0f}° to {high:.0f}° of flexion")


def test_a_hinge_with_two_covered_ranges():
    """A cable over the top is short at both ends of the way."""
    way = Route.over(("universe", (-0.4, 0.0, 0.0)), ("arm", (0.0, 0.0, -0.2)))
    sizes = {
        angle: np.linalg.norm([-0.4 - 0.2 * np.sin(np.radians(angle)), 0.2 * np.cos(np.radians(angle))])
        for angle in (40.0, 140.0)
    }
    top = Spring("top", TableLaw((0.3, sizes[40.0]), (1.0, 2.0)), route=way)
    assert sizes[40.0] == pytest.approx(sizes[140.0])
    found = springs_of(ep.load(URDF / "serial-y-x-z.urdf").replace(springs=[top]))
    assert found.detail.startswith("spring 'top': law covers 0° to 40° and 140° to 180° of flexion")
