"""What MuJoCo lets the motors of an exported design do: the tensions of its actuators, and no push of a cable."""

import mujoco
import numpy as np
import pytest

import exo_pin as ep
from exo_pin.muscle import muscle_model

MAN = ep.Arm.from_anthropometry(1.75, 75, sex="male")
#: Of the prototype's muscles: what the tests of the laws reached at the pressure of the supply, N.
CAPABLE = float(muscle_model("tang-optimised", 0.15).validity.capability_line(np.array(4e5)))
#: Least and greatest tension of the designs' actuators, N.
LIMITS = {
    "prototype": (0.0, CAPABLE),
    "four-cables": (0.0, 400.0),
    "four-cables-worn": (0.0, 400.0),
    "four-muscle-cables": (0.0, 200.0),
    "three-linear-actuators": (-400.0, 400.0),
    "four-linear-actuators": (-400.0, 400.0),
    "optimised-table-5-3": (0.0, np.inf),
    "scenario-one": (-np.inf, np.inf),
}


def exported(name, folder):
    chain = ep.load(name).worn_by(MAN).chain_with_masses()
    model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(folder)))
    return chain, model


def efforts(chain, tensions):
    tau = np.zeros(chain.model.nv)
    for limb, tension in zip(chain.roles.limbs, tensions, strict=True):
        tau[chain.velocity_slice(limb.slide)] = -tension
    return tau


@pytest.mark.parametrize("name", LIMITS)
def test_motors_have_the_limits_and_sign_of_the_design(name, tmp_path):
    chain, model = exported(name, tmp_path)
    data, slides = mujoco.MjData(model), [limb.slide for limb in chain.roles.limbs]
    mujoco.mj_resetDataKeyframe(model, data, 0)
    rng = np.random.default_rng(8)
    for asked in [np.full(model.nu, 1e5), np.full(model.nu, -1e5), *rng.uniform(-600.0, 600.0, (5, model.nu))]:
        data.ctrl[:] = asked
        mujoco.mj_forward(model, data)
        tensions = np.clip(asked, *LIMITS[name])
        np.testing.assert_allclose(data.actuator_force, tensions, atol=1e-9)
        # On the slides, which grow with the limbs.
        on_slides = [data.qfrc_actuator[int(model.joint(slide).dofadr[0])] for slide in slides]
        np.testing.assert_allclose(on_slides, -data.actuator_force, atol=1e-9)


def test_a_tension_moves_the_arm_as_in_the_chain(tmp_path):
    chain, model = exported("four-cables", tmp_path)
    # Loops nearly without give.
    model.eq_solref[:], model.opt.timestep = [2e-4, 1.0], 1e-4
    model.eq_solimp[:, :2], model.opt.tolerance, model.opt.iterations = 0.99999, 1e-14, 500
    data, q = mujoco.MjData(model), chain.close(chain.neutral())
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.ctrl[:] = tensions = [40.0, 300.0, 5.0, 120.0]
    mujoco.mj_forward(model, data)
    expected = chain.forward_dynamics(q, tau=efforts(chain, tensions)).a[:3]
    np.testing.assert_allclose(data.qacc[:3], expected, atol=1e-5 * np.abs(expected).max())
