"""Frame and cuff that could hold a design's joints: closed forms of their mass and inertia."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.design.holding_frame import (
    estimated_cuff,
    estimated_frame_mass,
    frame_parts,
    holding_bars,
    sleeve_size,
    with_cuff_by_geometry,
)

#: A square of joints, 0.1 m from the arm's axis and 0.15 m below the shoulder.
TURNS = np.radians([45.0, 135.0, 225.0, 315.0])
SQUARE = np.stack([0.1 * np.cos(TURNS), 0.1 * np.sin(TURNS), np.full(4, -0.15)], axis=1)
PER_METRE = 2700.0 * np.pi * (0.0065**2 - 0.005**2)


def square():
    return ep.WristGeometry(np.array([[0.3, 0.1, 0.2], [-0.3, 0.1, 0.2], [-0.3, 0.1, -0.2], [0.3, 0.1, -0.2]]), SQUARE)


def test_mass_of_a_square_by_hand():
    cuff = estimated_cuff(square())
    bow, struts = 0.75 * 2.0 * np.pi * 0.1, 4 * (0.1 - 0.066)
    sleeve = 1200.0 * 2.0 * np.pi * 0.066 * 0.004 * 0.06
    assert cuff.mass == pytest.approx(PER_METRE * (bow + struts) + 4 * 0.05 + sleeve, rel=2e-3)
    assert cuff.device
    assert sleeve_size(SQUARE) == pytest.approx((0.066, -0.18, -0.12))
    # The bow is open to one side.
    assert 0.001 < np.hypot(*cuff.centre_of_mass[:2]) < 0.02
    assert cuff.centre_of_mass[2] == pytest.approx(-0.15)
    assert np.linalg.eigvalsh(cuff.inertia)[0] > 0.0
    # As a ring of 0.1 m about the axis, but for sleeve and struts.
    assert cuff.mass * 0.066**2 < cuff.inertia[2, 2] < cuff.mass * 0.1**2


def test_inertia_of_the_cuff_by_its_parts():
    """Sleeve in closed form, bars as pieces at their middles, joints as points; the list of parts weighs the same."""
    geometry = ep.load("four-cables").geometry
    points, cuff = np.asarray(geometry.platform_points), estimated_cuff(geometry)
    radius, bottom, top = sleeve_size(points)
    shell, high = 1200.0 * 2.0 * np.pi * radius * 0.004 * (top - bottom), top - bottom
    bars = holding_bars(geometry)[1]
    at = np.concatenate([points, *((bar[1:] + bar[:-1]) / 2.0 for bar in bars)])
    mass = np.concatenate([np.full(len(points), 0.05), *(
        PER_METRE * np.linalg.norm(np.diff(bar, axis=0), axis=1) for bar in bars)])  # fmt: skip
    middle = np.array([0.0, 0.0, 0.5 * (bottom + top)])
    total = mass.sum() + shell
    centre = (mass @ at + shell * middle) / total
    assert cuff.mass == pytest.approx(total, rel=1e-12)
    np.testing.assert_allclose(cuff.centre_of_mass, centre, atol=1e-12)
    across = shell * (radius**2 / 2.0 + high**2 / 12.0 * (1.0 - 1.0 / 25.0))
    inertia = np.diag([across, across, shell * radius**2])
    for weight, spot in [(shell, middle), *zip(mass, at, strict=True)]:
        off = spot - centre
        inertia += weight * (off @ off * np.eye(3) - np.outer(off, off))
    np.testing.assert_allclose(cuff.inertia, inertia, atol=1e-12)
    rows = {name: (count, length, weight) for name, count, length, weight, _ in frame_parts(geometry)}
    assert rows["sleeve of the cuff"][1:] == pytest.approx((high, shell))
    assert rows["joints"][0] == 2 * len(points)
    assert rows["joints"][2] == pytest.approx(0.1 * len(points))
    own = sum(float(np.linalg.norm(np.diff(bar, axis=0), axis=1).sum()) for bar in bars)
    assert rows["bars of the cuff"] == pytest.approx((1, own, PER_METRE * own))
    whole = sum(weight for *_, weight in rows.values())
    assert whole == pytest.approx(estimated_frame_mass(geometry) + cuff.mass)
    texts = {name: text for name, *_, text in frame_parts(geometry)}
    assert texts["bars of the frame"] == "aluminium tube 13 x 1.5 mm, bent"
    assert texts["sleeve of the cuff"] == f"plastic, 4 mm, inner radius {1e3 * radius:.0f} mm"
    with pytest.raises(ep.MissingData, match="a person's arm"):
        with_cuff_by_geometry(ep.load("prototype").mechanism)
