"""The elevations that the laws of a device's springs cover, by the law of cosines."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.consistency import check
from exo_pin.device import LinearSpring, Route, Spring, TableLaw

BELOW, ON_ARM = 0.4, 0.2
WAY = Route.over(("universe", (0.0, 0.0, -BELOW)), ("arm", (0.0, 0.0, -ON_ARM)))


def length(degrees):
    return float(np.sqrt(BELOW**2 + ON_ARM**2 - 2.0 * BELOW * ON_ARM * np.cos(np.radians(degrees))))


def strut(low, high, name="strut"):
    return Spring(name, TableLaw((length(low), length(high)), (-9.0, -5.0)), route=WAY)


def springs_of(exo):
    (found,) = (each for each in exo.check().findings if each.name == "springs")
    return found


def test_the_range_of_a_law_is_found_in_both_planes():
    exo = ep.load(URDF / "spring-support.urdf").replace(springs=[strut(12.0, 97.0)])
    found = springs_of(exo)
    assert found.outcome == "note"
    assert found.detail == "spring 'strut': law covers 12° to 97° of flexion, 12° to 97° of abduction"
    assert "springs  spring 'strut': law covers 12°" in " ".join(str(exo.check()).split(" ")).replace(
        "           ", "  "
    )
    assert exo.check().passed


@pytest.mark.parametrize("seed", range(4))
def test_ends_at_random(seed):
    low, high = np.sort(np.random.default_rng(seed).uniform(5.0, 175.0, 2)).round()
    exo = ep.load(URDF / "serial-y-x-z.urdf").replace(springs=[strut(low, high)])
    assert springs_of(exo).detail.startswith(f"spring 'strut': law covers {low:.0f}° to {high:.0f}° of flexion")


def test_laws_without_ends_and_beyond_every_pose():
    exo = ep.load(URDF / "spring-support.urdf").replace(springs=[])
    assert all(each.name != "springs" for each in exo.check().findings)
    endless = springs_of(exo.replace(springs=[Spring("cord", LinearSpring(40.0), route=WAY)]))
    assert (endless.outcome, endless.detail) == ("pass", "no law has an end")
    far = Spring("far", TableLaw((2.0, 3.0), (1.0, 2.0)), route=WAY)
    several = springs_of(
        exo.replace(springs=[far, strut(0.0, 180.0, "whole"), Spring("cord", LinearSpring(40.0), route=WAY)])
    )
    assert several.outcome == "note"
    assert several.detail == (
        "spring 'far': law covers none of flexion, none of abduction; "
        "spring 'whole': law covers 0° to 180° of flexion, 0° to 180° of abduction"
    )
    whole = exo.replace(springs=[strut(0.0, 180.0)])
    assert springs_of(whole).outcome == "pass"
    assert check(whole.device).findings[-1] == springs_of(whole)


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
