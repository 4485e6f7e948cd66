"""SDF that is written, as Drake reads it."""

import numpy as np
import pytest
from massive_chains import MASSIVE
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from tree_forces import tree_forces

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closures

WRITTEN = {"cylindrical", "distance", "coupling"}


@pytest.fixture(params=MASSIVE)
def case(request):
    return MASSIVE[request.param]


def test_sdf_is_read_strictly(case, tmp_path):
    chain, q = case
    if WRITTEN & {closure.type for closure in chain.closures}:
        with pytest.raises(InvalidInput, match="SDF has no joint for the"):
            chain.to_sdf(tmp_path, q)
        return
    path = chain.to_sdf(tmp_path, q)
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()  # an element that is not in the schema is an error
    parser.AddModels(str(path))
    kinds = [joint.shortname() for joint in list(chain.model.joints)[1:]]
    free = kinds.count("JointModelFreeFlyer")
    assert plant.num_joints() == len(kinds) - free + len(chain.closures)


#: A rod on a cross without mass: hinges about x and y that meet 0.1 m from both joints' origins, and a ball at its end.
CROSS = """<robot name="rod"><link name="world"/><link name="base"><inertial><mass value="1"/>{I}</inertial></link>
<link name="cross"/><link name="rod"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>{I}</inertial></link>
<link name="tip"><inertial><mass value="0.5"/>{I}</inertial></link>
<joint name="turn" type="revolute"><parent link="world"/><child link="base"/><axis xyz="0 0 1"/>{L}</joint>
<joint name="roll" type="revolute"><parent link="base"/><child link="cross"/><origin xyz="0.2 0 0" rpy="0.3 0 0"/>
<axis xyz="1 0 0"/>{P}<dynamics damping="0.2" friction="0.1"/></joint>
<joint name="pitch" type="revolute"><parent link="cross"/><child link="rod"/><origin xyz="0.1 0.1 0"/>
<axis xyz="{Y}"/>{P}
<dynamics damping="0.2" friction="0"/></joint>
<joint name="wrist" type="revolute"><parent link="rod"/><child link="tip"/><origin xyz="0 0 -0.6"/>
<axis xyz="1 0 0"/>{L}<mimic joint="pitch" multiplier="2" offset="0"/></joint></robot>"""


def _rod(y="0 1 0"):
    moments = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/>'
    limit = '<limit lower="-1" upper="1.2" effort="5" velocity="3"/>'
    # Drake does not drive universal joints.
    passive = limit.replace('effort="5"', 'effort="0"')
    return ClosedChain.from_urdf(CROSS.format(I=moments, L=limit, P=passive, Y=y), Closures("rod"))


def test_a_massless_cross_is_written_as_a_universal_joint(tmp_path):
    chain = _rod()
    q = chain.close(np.array([0.2, 0.3, -0.2, -0.4]))
    path = chain.to_sdf(tmp_path, q)
    again = ClosedChain.from_sdf(path)
    assert list(again.model.names)[1:] == ["turn", "pitch_axis", "pitch_axis2", "wrist"]
    rng = np.random.default_rng(0)
    for _ in range(3):
        # The file counts from q. The coupling of what is free here is not asked.
        move, v = rng.uniform(-0.5, 0.5, 4), rng.normal(size=4)
        for one, other in (
            (tree_forces(chain, q + move, v, np.zeros(4)).tau, tree_forces(again, move, v, np.zeros(4)).tau),
            (chain.placement(q + move, "tip").homogeneous, again.placement(move, "tip").homogeneous),
        ):
            np.testing.assert_allclose(one, other, atol=1e-12)
    np.testing.assert_allclose(again.model.lowerPositionLimit, chain.model.lowerPositionLimit - q, atol=1e-12)
    np.testing.assert_allclose(again.model.damping, chain.model.damping)
    (coupling,) = again.closures
    assert (coupling.frame_a, coupling.frame_b) == ("pitch_axis2", "wrist")
    # Drake reads it strictly, and its own universal joint is the same.
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.SetStrictParsing()
    parser.AddModels(str(path))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.GetJointByName("turn").set_angle(context, 0.4)
    plant.GetJointByName("pitch").set_angles(context, [0.3, -0.5])
    found = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("rod"))
    here = chain.placement(q + np.array([0.4, 0.3, -0.5, 0.0]), "rod")
    np.testing.assert_allclose(found.translation(), here.translation, atol=1e-12)
    np.testing.assert_allclose(found.rotation().matrix(), here.rotation, atol=1e-12)
