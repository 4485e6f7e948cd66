"""Limits of three limbs, whose forces equilibrium determines, one at a time: answer and map have the same outcome."""

import numpy as np
import pytest
from three_limbs import Wrist

import exo_pin as ep

#: Relative rounding of the largest tension by which a limit may be passed.
ROUNDING = 1e-9


@pytest.fixture(scope="module", params=[1, 2])
def wrist(request):
    return Wrist(request.param)


@pytest.mark.parametrize("limb", [0, 1, 2])
@pytest.mark.parametrize("end", ["shortest", "longest"])
def test_each_end_of_each_stroke(wrist, limb, end):
    inwards = -1.0 if end == "longest" else 1.0
    for off in (1e-6, -1e-6, 1e-10):
        change = {limb: {end: wrist.lengths[limb] + inwards * off}}
        # A length at the end, to a nanometre, is within the stroke.
        expected = "out_of_stroke" if off == 1e-6 else "ok"
        status, unknown, limits = wrist.outcome(change)
        assert (status, unknown) == (expected, False)
        np.testing.assert_allclose(
            limits.length_error, -inwards * max(off - 1e-9, 0.0) * (np.arange(3) == limb), atol=2e-15
        )
        # By an estimate it is out for all that is known, but not for sure, unless another limit is broken, too.
        status, unknown, limits = wrist.outcome(change, [limb])
        assert (status, unknown) == (expected, True)
        assert limits.estimated == (f"limbs[{limb}].stroke.travel",)
        weak = {"pull": 0.5 * wrist.size, "push": 0.5 * wrist.size}
        broken = change | {int(np.abs(wrist.f).argmax()): change.get(int(np.abs(wrist.f).argmax()), {}) | weak}
        status, unknown, _ = wrist.outcome(broken, [limb])
        assert (status, unknown) == ("out_of_stroke" if off == 1e-6 else "beyond_limits", False)
    status, unknown, limits = wrist.outcome({limb: {"fitting": None}})
    assert (status, unknown) == ("ok", True)
    assert np.isnan(limits.length_error[limb])
    assert limits.missing == (f"end fitting of limb {limb + 1}",)


@pytest.mark.parametrize("limb", [0, 1, 2])
def test_each_limit_of_each_force(wrist, limb):
    force = wrist.f[limb]
    acting, idle = ("pull", "push") if force > 0.0 else ("push", "pull")
    for off in (0.5 * ROUNDING, 2.0 * ROUNDING, 0.1):
        beyond = off * wrist.size
        if beyond >= abs(force):
            continue
        status, unknown, limits = wrist.outcome({limb: {acting: abs(force) - beyond}})
        assert (status, unknown) == ("ok" if off < ROUNDING else "beyond_limits", False)
        expected = np.sign(force) * max(beyond - ROUNDING * wrist.size, 0.0) * (np.arange(3) == limb)
        np.testing.assert_allclose(limits.force_error, expected, atol=1e-12 * wrist.size)
        # Numbers narrow the limits of the design alike, and never widen them.
        ends = [-1e5, abs(force) - beyond] if force > 0.0 else [beyond - abs(force), 1e5]
        given = [np.where(np.arange(3) == limb, end, wide) for end, wide in zip(ends, (-1e5, 1e5), strict=True)]
        assert wrist.outcome(limits=tuple(given))[:2] == (status, False)
        assert wrist.outcome({limb: {acting: abs(force) - beyond}}, limits=(-1e5, 1e5))[:2] == (status, False)
    status, unknown, limits = wrist.outcome({limb: {acting: None}})
    assert (status, unknown) == ("ok", True)
    assert np.isnan(limits.force_error).tolist() == [i == limb for i in range(3)]
    assert wrist.outcome({limb: {acting: None}}, limits=(-1e5, 1e5))[:2] == ("ok", False)
    # What is not known and does not act leaves nothing open, nor does it beside a limit that is broken.
    assert wrist.outcome({limb: {idle: None}})[:2] == ("ok", False)
    other = (limb + 1) % 3
    weak = {acting: None}, {"pull": 0.9 * abs(wrist.f[other]), "push": 0.9 * abs(wrist.f[other])}
    assert wrist.outcome(dict(zip((limb, other), weak, strict=True)))[:2] == ("beyond_limits", False)


@pytest.mark.parametrize("limb", [0, 1, 2])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_speed_and_power_of_a_moving_limb(wrist, limb, way):
    """Power bounds what a limb pulls while it shortens, or pushes while it lengthens; a brake takes none."""
    omega = way * np.array([0.8, -0.5, 0.6])
    force, motion = wrist.f[limb], ep.Motion(omega, np.zeros(3))
    still = wrist.exo.reaction(wrist.pose, motion).actuator_forces[limb]
    rate = -(wrist.exo.jacobian(wrist.pose) @ omega)[limb]
    assert np.sign(still) == np.sign(force)
    for share in (1.01, 0.99):
        status, unknown, limits = wrist.outcome({limb: {"speed": share * abs(rate)}}, motion=motion)
        assert (status, unknown) == ("ok" if share > 1.0 else "beyond_limits", False)
        expected = max(1.0 - share, 0.0) * abs(rate) * (np.arange(3) == limb)
        np.testing.assert_allclose(limits.excess_speed, expected, atol=1e-12)
        assert wrist.outcome({limb: {"speed": share * abs(rate)}})[:2] == ("ok", False)
        power = still * rate
        status, unknown, limits = wrist.outcome({limb: {"power": share * abs(power)}}, motion=motion)
        brakes = power < 0.0
        assert (status, unknown) == ("ok" if share > 1.0 or brakes else "beyond_limits", False)
        if not brakes and share < 1.0:
            assert limits.force_error[limb] == pytest.approx((1.0 - share) * still, rel=1e-6)


def test_splits_by_name_and_of_the_user():
    def own(base, **attributes):
        return type("Own", (type(ep.reaction.SPLITS[base]),), attributes)()

    for split, error in (
        (type(ep.reaction.SPLITS["minimal"]), "got the class"),
        (own("minimal", name="minimal"), "another one than Own"),
        (own("minimal", name=""), "to be words"),
        (own("minimal", name="moves", moves=True), "child of Elastic"),
    ):
        with pytest.raises(ep.InvalidInput, match=error):
            ep.Assumptions(split)
    elastic = own("elastic")
    elastic.name = "own"
    assert ep.Assumptions(elastic).split is elastic
