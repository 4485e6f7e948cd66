"""Poses that the law of a spring does not cover: a status of their own, by lengths in closed form."""

import ast
from pathlib import Path

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
import exo_pin.device
from exo_pin.device import (
    ConstantForce,
    Route,
    Spring,
    SpringLaw,
    TableLaw,
)

#: Distances from the shoulder of the strut's ends, m, below it on the torso and on the arm.
BELOW, ON_ARM = 0.4, 0.2
WAY = Route.over(("universe", (0.0, 0.0, -BELOW)), ("arm", (0.0, 0.0, -ON_ARM)))
TABLE = TableLaw((0.285, 0.4, 0.9), (-30.0, -20.0, -10.0))


def length(elevation):
    """Of the strut, m, at an elevation of the arm, rad: law of cosines."""
    return np.sqrt(BELOW**2 + ON_ARM**2 - 2.0 * BELOW * ON_ARM * np.cos(elevation))


def elevation(size):
    """The other way round, degrees."""
    return np.degrees(np.arccos((BELOW**2 + ON_ARM**2 - size**2) / (2.0 * BELOW * ON_ARM)))


def support(law=TABLE, name="strut"):
    """A passive support."""
    return ep.load(URDF / "spring-support.urdf").replace(springs=[Spring(name, law, route=WAY)])


def motors(*springs):
    return ep.load(URDF / "serial-y-x-z.urdf").replace(springs=springs)


def test_no_number_stands_where_data_lack_and_the_others_stay():
    """A pose's answer is the same with others in the stack; where the table holds it is that of a longer table."""
    exo = support()
    poses = exo.pose([0.0, 20.0, 60.0, 110.0], [0.0, 10.0, 0.0, 30.0])
    answer, whole = exo.reaction(poses), support(ConstantForce(0.0)).reaction(poses)
    lost = answer.status == "not_evaluated"
    assert lost.tolist() == [True, True, False, False]
    for name in ("shoulder_force", "actuator_forces", "limb_wrenches", "cuff_wrench", "harness_wrenches", "residual"):
        values = getattr(answer, name).reshape(4, -1)
        assert np.isnan(values[lost]).all(), name
        assert np.isfinite(values[~lost]).all(), name
    alone = [exo.reaction(poses[k]).shoulder_force for k in (2, 3)]
    np.testing.assert_array_equal(answer.shoulder_force[~lost], alone)
    # By hand: the strut's force on the arm, and its moment about the shoulder.
    for k in (2, 3):
        at, start = poses[k].apply([0.0, 0.0, -ON_ARM]), np.array([0.0, 0.0, -BELOW])
        size = np.linalg.norm(at - start)
        push = TABLE.force(size) * (start - at) / size
        np.testing.assert_allclose(whole.shoulder_force[k] - answer.shoulder_force[k], push, atol=1e-9)
        np.testing.assert_allclose(whole.actuator_forces[k] - answer.actuator_forces[k], np.cross(at, push), atol=1e-9)


def test_the_ends_of_a_table_are_covered():
    """Also where rounding puts the length beside them, and no further."""
    exo, steps = support(TableLaw((0.285, 0.4, 0.5), (-30.0, -20.0, -10.0))), np.array([0.0, 1e-9, -1e-9])
    for end, out in ((0.285, -1.0), (0.5, 1.0)):
        assert exo.reaction(exo.pose(elevation(end) + steps)).reasons.tolist() == [""] * 3
        assert exo.reaction(exo.pose(elevation(end) + out * 1e-4)).status == "not_evaluated"


def test_a_law_of_ones_own_says_where_it_ends():
    class Short(SpringLaw):
        """Known up to 0.4 m."""

        range = (0.0, 0.4)

        def force(self, x):
            return 10.0 + 0.0 * np.asarray(x)

        def energy(self, x):
            return 10.0 * np.asarray(x)

    class Silent(Short):
        """Says it by NaN."""

        range = (-np.inf, np.inf)

        def force(self, x):
            return np.where(np.asarray(x) < 0.4, 10.0, np.nan)

    class Broken(Short):
        """Fails by a mistake of its own, which nobody else may hide."""

        def force(self, x):
            raise ep.InvalidInput("a mistake of this law")

    angles = [elevation(0.3), elevation(0.5)]
    for law, words in ((Short(), ", law 0 to 0.4 m"), (Silent(), "")):
        answer = support(law).reaction(support().pose(angles))
        assert answer.reasons.tolist() == ["", f"spring 'strut' outside its law: 0.5 m{words}"]
    with pytest.raises(ep.InvalidInput, match="a mistake of this law"):
        support(Broken()).reaction(support().pose(angles[:1]))


@pytest.mark.full
def test_an_uncertainty_at_the_end_of_data_is_no_pose_without_equilibrium():
    """10 mm of offset lead out of the table: that is missing data, and not a force without bound."""
    exo = motors(Spring("strut", TABLE, route=WAY)).worn_by(ep.Person(1.75, 75, "male"))
    exo = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19)))
    pose = exo.pose(elevation(0.285) + 0.5)
    with pytest.raises(ep.MissingData, match=r"spring 'strut' outside its law: 0\.28"):
        exo.uncertainty(pose, split="elastic", uncertainties={"offset_mm": 10})


def test_nothing_in_the_device_swallows_every_error():
    """Handlers name the one thing that they expect."""
    for path in Path(exo_pin.device.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ExceptHandler) and not isinstance(node.body[-1], ast.Raise):
                caught = {each.id for each in ast.walk(node.type) if isinstance(each, ast.Name)}
                assert not caught & {"ExoPinError", "Exception", "BaseException"}, path.name
