"""Forms in which an offset of the device's centre is given."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import CentrePath, InvalidInput
from exo_pin.load_case import CentreOffset
from exo_pin.workspace import Criteria
from exo_pin.wrist import BodyShape

ELEVATIONS = np.linspace(0.0, np.pi, 7)


#: A shoulder that goes back, in and up, as in docs/concepts/wearer.md, and a device that is off at rest, too.
PATH = CentrePath(
    ELEVATIONS,
    0.03 * np.stack([-np.sin(0.5 * ELEVATIONS), -0.5 * np.sin(0.4 * ELEVATIONS) ** 2, 0.4 * ELEVATIONS], axis=-1),
    (0.004, -0.003, 0.006),
)


BODY = BodyShape.of(ep.Wearer(1.75, 75, "male"))


def test_forms_of_an_offset_agree():
    exo = ep.load("four-cables")
    limits = Criteria(largest_shoulder_force=120.0, body=BODY)
    poses = exo.pose(flexion=np.linspace(0.0, 80.0, 6)[:, None], abduction=np.linspace(0.0, 60.0, 4))
    shift = np.array([0.01, 0.0, -0.005])
    same = [
        exo.workspace(poses, limits, centre_offset=given)
        for given in (shift, shift.tolist(), CentreOffset.together(shift), np.tile(shift, (6, 4, 1)), shift[None, None])
    ]
    moving = [exo.workspace(poses, limits, centre_offset=given) for given in (PATH, PATH.offset(poses))]
    still = [exo.workspace(poses, limits, centre_offset=given) for given in (None, np.zeros(3))]
    for group in (same, moving, still):
        for other in group[1:]:
            for name, margin in group[0].margins.items():
                np.testing.assert_array_equal(other.margins[name], margin)
    assert same[0].centre_offset.base.shape == (6, 4, 3)
    assert still[0].centre_offset is None
    with pytest.raises(ValueError, match="read-only"):
        moving[0].centre_offset.base[0, 0, 0] = 1.0


def test_single_pose_on_a_path():
    exo, limits = ep.load("four-cables"), Criteria(largest_shoulder_force=120.0, body=BODY)
    stack = exo.workspace(exo.pose(abduction=[90.0, 30.0]), limits, centre_offset=PATH)
    found = exo.workspace(exo.pose(abduction=90.0), limits, centre_offset=PATH)
    assert found.inside.shape == ()
    assert found.centre_offset.base.shape == (3,)
    for name, margin in found.margins.items():
        np.testing.assert_array_equal(margin, stack.margins[name][0])
    assert found.volume_share is None
    assert "by at most" in str(found)


def test_other_shoulder_with_the_mirrored_path_works_alike():
    exo = ep.load("four-cables")
    right, limits = exo.mirrored(), Criteria(largest_shoulder_force=120.0, body=BODY)
    left = exo.workspace(exo.pose(flexion=[20, 60], abduction=[70, 30]), limits, centre_offset=PATH)
    other = right.workspace(
        right.pose(flexion=[20, 60], abduction=[70, 30]),
        limits.replace(body=BodyShape.of(ep.Wearer(1.75, 75, "male"), "right")),
        centre_offset=PATH.mirrored(),
    )
    for name, margin in left.margins.items():
        np.testing.assert_allclose(other.margins[name], margin, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("offset", "message"),
    [
        ([0.01, 0.02], "centre_offset"),
        ([0.01, np.nan, 0.0], "finite"),
        ([10.0, 0.0, 0.0], "millimetres"),
        (np.zeros((5, 3)), "broadcast"),
        ("front", "centre_offset"),
        (CentrePath([0.0, 0.2], [[0, 0, 0], [0, 0, 0.01]]), "where the path is known"),
    ],
)
def test_bad_offsets_are_refused(offset, message):
    exo = ep.load("four-cables")
    with pytest.raises(InvalidInput, match=message):
        exo.workspace(exo.pose(flexion=[0.0, 30.0]), ["forces"], centre_offset=offset)
