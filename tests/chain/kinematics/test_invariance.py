"""What a chain says of itself does not depend on how it is written down."""

import dataclasses

import exchanged_closures
import numpy as np
import pytest
from exchanged_closures import exchanged
from mechanisms import five_bar, four_bar, parallelogram, planar_3rrr, random_loop
from scipy.spatial.transform import Rotation
from spatial_mechanisms import agile_eye, delta, stewart

from exo_pin import thesis_rotation
from exo_pin.chain import TYPES, ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

KINDS = [kind for kind in TYPES if kind != "point"]
NAMED = {
    "four_bar": four_bar(),
    "four_bar_link": four_bar("link"),
    "five_bar": five_bar(),
    "3rrr": planar_3rrr(),
    "3rrr-radial": planar_3rrr(radial=True),
    "agile_eye": agile_eye(),
    "delta": delta(),
    "delta-universal": delta("universal"),
    "stewart": stewart(),
    "parallelogram": parallelogram(),
} | {f"loop-{kind}": random_loop(kind) for kind in KINDS}
FRAMES = {"four_bar": "rocker", "four_bar_link": "lower", "five_bar": "tip"} | {
    f"loop-{kind}": "left_3" for kind in KINDS
}
#: Those whose closures have frames.
WITH_FRAMES = [name for name in NAMED if name != "loop-coupling"]


def results(chain, q, name):
    """All that mobility says, as numbers that may be compared."""
    mobility = chain.mobility(q, frame=FRAMES.get(name))
    margins = mobility.margins
    return (
        (mobility.rank, mobility.redundant, mobility.kinds, mobility.idle, dict(mobility.redundant_closures)),
        (mobility.locked.rank, mobility.locked.redundant, dict(mobility.locked.redundant_closures)),
        np.array([*margins.effort.values(), *margins.travel.values()]),
    )


def assert_same(one, other):
    assert one[:2] == other[:2]
    np.testing.assert_allclose(one[2], other[2], rtol=1e-7, atol=1e-9)


def rewritten(named, change):
    closures = tuple(change(closure) for closure in named.closures.closures)
    return ClosedChain.from_urdf(named.urdf, dataclasses.replace(named.closures, closures=closures))


@pytest.mark.parametrize("name", WITH_FRAMES)
def test_exchanging_the_ends_of_a_closure_changes_nothing(name):
    named = NAMED[name]
    other = rewritten(named, lambda closure: exchanged(closure))
    assert np.abs(other.residual(named.q)).max() < 1e-14
    assert_same(results(named.chain(), named.q, name), results(other, named.q, name))
    # Twice is none.
    again = rewritten(named, lambda closure: exchanged(exchanged(closure)))
    np.testing.assert_allclose(
        again.constraint_jacobian(named.q), named.chain().constraint_jacobian(named.q), atol=1e-14
    )


@pytest.mark.parametrize("name", WITH_FRAMES)
def test_turning_both_frames_of_a_closure_changes_nothing(name):
    named = NAMED[name]
    rng = np.random.default_rng(5)

    def turned(closure):
        quaternion = Rotation.random(rng=rng).as_quat()
        axis = closure.axis
        if TYPES[closure.type].has_axis:
            axis = Rotation.from_quat(quaternion).inv().apply((0.0, 0.0, 1.0) if axis is None else axis)
        elif closure.type == "universal":
            quaternion = (0.0, 0.0, 1.0, 0.0)  # both axes reversed
        return dataclasses.replace(
            closure,
            axis=axis,
            placement_a=exchanged_closures.turned(closure.placement_a, quaternion),
            placement_b=exchanged_closures.turned(closure.placement_b, quaternion),
        )

    other = rewritten(named, turned)
    assert np.abs(other.residual(named.q)).max() < 1e-12
    assert_same(results(named.chain(), named.q, name), results(other, named.q, name))


def test_the_choice_of_the_cut_changes_nothing_of_a_delta():
    one, other = (delta(legs).chain() for legs in ("universal", "rigid"))
    for angles in ((0.0, 0.0, 0.0), (0.3, -0.2, 0.1)):
        answers = [
            chain.mobility(chain.forward_kinematics(angles, delta(legs).q))
            for chain, legs in ((one, "universal"), (other, "rigid"))
        ]
        assert answers[0].degrees_of_freedom == answers[1].degrees_of_freedom == 3
        assert answers[0].redundant == answers[1].redundant == 0
        for key in ("effort", "travel"):
            assert getattr(answers[0].margins, key) == pytest.approx(getattr(answers[1].margins, key), abs=1e-9)


@pytest.mark.parametrize("pose", [(40, -20, -30), (90, 0, 0)])
def test_the_shoulder_as_root_or_as_closure(pose):
    # A ball joint of the tree, or a free arm held by a closure: the same mechanism.
    answers = []
    for part in ("whole", "floating"):
        chain = ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part))
        q = chain.neutral()
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = thesis_rotation(*pose, degrees=True).as_quat()
        answers.append(chain.mobility(chain.close(q, hold=["root_joint"]), part="orientation"))
    one, other = answers
    assert one.kinds == other.kinds == (("output",) if pose == (90, 0, 0) else ())
    assert one.degrees_of_freedom == other.degrees_of_freedom == 3
    assert one.redundant == other.redundant == 3
    assert one.margins.effort == pytest.approx(other.margins.effort, rel=1e-6)
    assert one.margins.travel == pytest.approx(other.margins.travel, rel=1e-6)
