"""Wrenches of a device on the arm: mirror image, other centre, stacks, and what is refused."""

import numpy as np
import pytest
from mirror_image import MIRROR

import exo_pin as ep
from exo_pin import InfeasibleBounds, InvalidInput


def some_action(seed=1, shape=(2,), n=3, side_forces=1, **changes):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-50.0, 0.0, (*shape, n))
    fields = {
        "constant": rng.normal(size=(*shape, 6)),
        "limbs": rng.normal(size=(*shape, n, 6)),
        "lower": low,
        "upper": low + 60.0,
        "side_forces": side_forces,
    }
    return ep.DeviceAction(**(fields | changes))


def wrench(action, f):
    return action.constant + np.einsum("...ni,...n->...i", action.limbs, f)


@pytest.mark.parametrize("side_forces", [0, 1, 3])
def test_mirror_image_pulls_as_the_mirror_image_of_the_forces(side_forces):
    """Axes of side forces are pseudovectors: the mirror image of a side force g is -g along its own axis."""
    action = some_action(side_forces=side_forces)
    sign = np.where(np.arange(3) < 3 - side_forces, 1.0, -1.0)
    f = np.random.default_rng(7).normal(size=(2, 3))
    there, here = wrench(action.mirrored(), sign * f), wrench(action, f)
    np.testing.assert_allclose(there[:, :3], here[:, :3] @ MIRROR, atol=1e-14)
    np.testing.assert_allclose(there[:, 3:], -here[:, 3:] @ MIRROR, atol=1e-14)
    # What is allowed here is allowed there.
    for bound in (action.lower, action.upper):
        moved = sign * bound
        assert (action.mirrored().lower <= moved).all()
        assert (moved <= action.mirrored().upper).all()
    np.testing.assert_array_equal(np.diff([action.mirrored().lower, action.mirrored().upper], axis=0)[0], 60.0)
    for name in ("constant", "limbs", "lower", "upper"):
        np.testing.assert_array_equal(getattr(action.mirrored().mirrored(), name), getattr(action, name))


def test_about_another_centre_only_the_moments_differ():
    action, shift = some_action(), np.array([0.01, -0.02, 0.03])
    for name in ("constant", "limbs"):
        before, after = getattr(action, name), getattr(action.about(shift), name)
        np.testing.assert_array_equal(after[..., :3], before[..., :3])
        np.testing.assert_allclose(after[..., 3:], before[..., 3:] + np.cross(before[..., :3], shift), atol=1e-15)


def test_one_row_serves_all_poses_of_a_stack():
    action = some_action(shape=(), held=np.array([[True], [False]]))
    flat = action.flat((2, 3))
    for name in ("constant", "limbs", "lower", "upper"):
        for row in getattr(flat, name):
            np.testing.assert_array_equal(row, getattr(action, name))
        assert len(getattr(flat, name)) == 6
    assert flat.held.tolist() == [True] * 3 + [False] * 3
    rows = some_action(shape=(3,)).flat((2, 3))
    np.testing.assert_array_equal(rows.limbs[:3], rows.limbs[3:])
    single = some_action(shape=()).flat(())
    assert [getattr(single, name).shape for name in ("constant", "limbs", "lower")] == [(1, 6), (1, 3, 6), (1, 3)]
    with pytest.raises(InvalidInput, match=r"broadcast to the poses' shape \(4,\)"):
        some_action(shape=(3,)).flat((4,))


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"constant": np.zeros(5)}, InvalidInput, "constant"),
        ({"constant": np.full(6, np.nan)}, InvalidInput, "constant"),
        ({"limbs": np.zeros(6)}, InvalidInput, r"limbs to have shape \(..., n, 6\), got \(6,\)"),
        ({"limbs": np.zeros((3, 5))}, InvalidInput, r"limbs to have shape \(..., n, 6\), got \(3, 5\)"),
        ({"lower": np.zeros(2)}, InvalidInput, r"lower to have shape \(..., 3\), got \(2,\)"),
        ({"upper": np.zeros(())}, InvalidInput, r"upper to have shape \(..., 3\), got \(\)"),
        ({"least": "force"}, InvalidInput, "what is made small"),
        ({"side_forces": -1}, InvalidInput, "side_forces as a number of 0 to 3, got -1"),
        ({"side_forces": 4}, InvalidInput, "side_forces as a number of 0 to 3, got 4"),
        ({"side_forces": 1.0}, InvalidInput, "side_forces"),
    ],
)
def test_wrong_actions_are_refused(changes, error, words):
    with pytest.raises(error, match=words):
        some_action(shape=(), **changes)


def test_crossed_bounds_are_refused_by_limb():
    low = np.array([[0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(InfeasibleBounds) as told:
        some_action(lower=low, upper=np.full((2, 3), 4.0))
    assert told.value.limbs == (1,)
    # Equal bounds are given forces, and missing ones are of poses without a result.
    some_action(lower=low, upper=low, side_forces=3)
    some_action(lower=np.full(3, np.nan), upper=np.zeros(3), side_forces=0)
    assert ep.DeviceAction(np.zeros(6), np.zeros((0, 6)), np.zeros(0), np.zeros(0)).held is True


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"power": 1}, "power to be 2 or 3, got 1"),
        ({"power": 2.0}, "power"),
        ({"weights": "mass"}, "weights"),
        ({"load_on": "hand"}, "load_on"),
        ({"passive": 1}, "passive"),
        ({"centre_shift": (0.0, 0.0)}, "centre_shift"),
        ({"centre_shift": (0.0, -0.0501, 0.0)}, "within 0.05 m"),
        ({"socket_turn": -1.58}, "socket_turn in rad, within a right angle"),
        ({"socket_turn": 1.58}, "degrees"),
        ({"socket_turn": np.nan}, "socket_turn"),
        ({"cone": ep.GlenoidCone(muscle_compression=30.0)}, "ratios only"),
        ({"cone": ep.GlenoidCone(penalty=1.0)}, "ratios only"),
    ],
)
def test_wrong_assumptions_are_refused(changes, words):
    with pytest.raises(InvalidInput, match=words):
        ep.ContactOptions(**changes)


def test_assumptions_up_to_their_ends_are_taken():
    edge = ep.ContactOptions(centre_shift=(0.05, -0.05, 0.0), socket_turn=-np.pi / 2)
    np.testing.assert_array_equal(edge.centre_shift, [0.05, -0.05, 0.0])
    assert edge.socket_turn == -np.pi / 2
    plain = ep.ContactOptions()
    assert (plain.power, plain.weights, plain.passive, plain.load_on) == (2, "equal", False, "upper arm")
    assert not plain.centre_shift.any()
    assert plain.socket_turn == 0.0
    # Shear over compression that dislocates: Lippitt 1993 as in docs/reference; the ratios of the default cone.
    assert (plain.cone.superior, plain.cone.anterior) == (ep.GlenoidCone().superior, ep.GlenoidCone().anterior)


def test_words_of_the_assumptions():
    man = ep.Person(1.75, 75, "male")
    words = ep.ContactOptions().described(man, moving=False)
    assert words["criterion"].startswith("least sum of squared activations, equal weights")
    assert words["socket"] == "inside the rim, shear over compression up to 0.61 (superior) and 0.34 (anterior)"
    assert f"strength x {man.strength_scale:.3g}, lengths x {man.length_scale:.3g}, force-length, " in words["muscles"]
    assert words["muscles"].endswith("passive forces off")
    other = ep.ContactOptions(power=3, weights="volume", passive=True, cone=None).described(man, moving=True)
    assert other["criterion"].startswith("least sum of cubed activations, volume weights")
    assert other["socket"] == "none"
    assert other["muscles"].endswith("force-length and force-velocity, passive forces on")
