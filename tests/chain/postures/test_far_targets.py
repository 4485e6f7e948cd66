"""Targets many lengths of a chain away, and what stands in the way."""

import numpy as np
import pinocchio as pin
import pytest
from rubbing_chains import slide

from exo_pin.chain import FrameTask

pytestmark = pytest.mark.usefixtures("plain")


def target(place, angle=0.0):
    return FrameTask("block", pin.SE3(np.eye(3), place * np.array([np.cos(angle), 0.0, np.sin(angle)])))


@pytest.mark.parametrize("lengths", [-30.0, 0.3, 30.0])
def test_steps_grow_on_the_way_to_a_far_target(lengths):
    """The error is quadratic, so that every step keeps its promise: a hundred of the first size would not do."""
    chain = slide(angle=0.4)
    answer = chain.inverse_kinematics(target(lengths * chain.characteristic_length, 0.4))
    np.testing.assert_allclose(answer.q, lengths * chain.characteristic_length, rtol=1e-9)
    assert answer.error < 1e-8
    assert answer.cautions == ()
    assert answer.at_limits == ()


def test_a_target_beyond_a_limit_is_approached_up_to_it():
    chain = slide(limits=(-0.2, 0.7))
    for place, end in ((3.0, 0.7), (-2.0, -0.2)):
        answer = chain.inverse_kinematics(target(place))
        assert answer.q[0] == end
        assert answer.error == pytest.approx(abs(place - end), rel=1e-12)
        assert answer.at_limits == ("slide",)
    # A start beyond the limits is brought within them.
    np.testing.assert_allclose(chain.inverse_kinematics(target(0.3), [5.0]).q, 0.3, atol=1e-9)


def test_errors_across_the_slide_stay():
    chain = slide()
    answer = chain.inverse_kinematics(target(2.0, angle=np.pi / 3))
    np.testing.assert_allclose(answer.q, 1.0, atol=1e-9)
    assert answer.error == pytest.approx(np.sqrt(3.0), rel=1e-9)
    assert answer.kkt <= 1e-8
