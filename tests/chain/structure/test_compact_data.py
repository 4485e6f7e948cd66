"""Pinocchio's Data without arrays of nv³ numbers: the same numbers as Pinocchio's own, in a tenth of the memory."""

import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain, Closure, Closures
from exo_pin.chain.structure.memory import compact_data as module
from exo_pin.chain.structure.memory.compact_data import compact_data, data_for


def unit(rng):
    """A random direction."""
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)


#: Every class of joint but the nested ones.
KINDS = {
    "hinge": lambda rng: pin.JointModelRY(),
    "hinge about any axis": lambda rng: pin.JointModelRevoluteUnaligned(unit(rng)),
    "endless hinge": lambda rng: pin.JointModelRUBZ(),
    "slide": lambda rng: pin.JointModelPX(),
    "slide along any axis": lambda rng: pin.JointModelPrismaticUnaligned(unit(rng)),
    "screw": lambda rng: pin.JointModelHX(rng.uniform(0.1, 1.0)),
    "ball": lambda rng: pin.JointModelSpherical(),
    "ball of three angles": lambda rng: pin.JointModelSphericalZYX(),
    "universal": lambda rng: pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]),
    "planar": lambda rng: pin.JointModelPlanar(),
    "translation": lambda rng: pin.JointModelTranslation(),
    "free": lambda rng: pin.JointModelFreeFlyer(),
    "ellipsoid": lambda rng: pin.JointModelEllipsoid(0.3, 0.2, 0.1),
}


def tree(rng, count, kinds=tuple(KINDS)):
    """A random tree whose joints are numbered depth first."""
    model, path = pin.Model(), [0]
    for k in range(count):
        path = path[: int(rng.integers(max(1, len(path) - 2), len(path) + 1))]
        kind = KINDS[kinds[int(rng.integers(len(kinds)))]](rng)
        path.append(model.addJoint(path[-1], kind, pin.SE3.Random(), f"joint_{k}"))
        model.appendBodyToJoint(path[-1], pin.Inertia.Random(), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"frame_{k}", path[-1], 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    model.gravity.linear = rng.normal(size=3)
    return model


@pytest.mark.parametrize(
    ("seed", "most"),
    [(0, 8), (7, 8), *(pytest.param(k, most, marks=pytest.mark.full) for k in range(8) for most in (8, 20))],
)
def test_every_member_is_that_of_a_new_data(seed, most):
    """Random trees: all that is not left out is in Pinocchio's own archive of the Data, number by number.

    Archives grow with the cube of the coordinates: trees of up to 20 joints are in the full set.
    """
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    model = tree(rng, int(rng.integers(1, most)))
    own, plain = (module._archive(data) for data in (compact_data(model), pin.Data(model)))
    assert [member.tag for member in own] == [member.tag for member in plain]
    for mine, other in zip(own, plain, strict=True):
        if other.tag not in module._LEFT_OUT:
            assert module._words(mine) == module._words(other), other.tag


def closed_tree(rng):
    """A tree of 90 coordinates or more with closures that Pinocchio has."""
    model = tree(rng, 45, ("hinge", "hinge about any axis", "slide", "ball", "free", "screw", "planar"))
    closures = [Closure(f"c{k}", "spherical", f"frame_{k}", f"frame_{k + 20}") for k in range(0, 20, 5)]
    return model, Closures("random", closures=tuple(closures))


def results(model, constraints, data, q, v, a, forces):
    """All that the package takes from a Data."""
    found = {"rnea": pin.rnea(model, data, q, v, a, forces).copy()}
    found["wrenches"] = np.array([force.vector for force in data.f])
    pin.computeJointJacobiansTimeVariation(model, data, q, v)
    found |= {"J": data.J.copy(), "dJ": data.dJ.copy()}
    found["M"] = np.triu(pin.crba(model, data, q))
    found["energy"] = np.array([pin.computePotentialEnergy(model, data, q)])
    found["gravity"] = pin.computeGeneralizedGravity(model, data, q).copy()
    for name, part in zip("qva", pin.computeRNEADerivatives(model, data, q, v, a), strict=True):
        found[f"by {name}"] = np.triu(part) if name == "a" else part.copy()
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for constraint in constraints:
        models.append(constraint)
        datas.append(constraint.createData())
    pin.initConstraintDynamics(model, data, models, datas)
    settings = pin.ProximalSettings(1e-14, 1e-10, 40)
    found["ddq"] = pin.constraintDynamics(model, data, q, v, a, models, datas, settings).copy()
    pin.updateFramePlacements(model, data)
    found["frames"] = np.array([pose.homogeneous for pose in data.oMf])
    return found


@pytest.mark.parametrize("seed", range(2))
def test_results_are_the_same(seed):
    """Every function of Pinocchio that the package calls returns the same bits as with an ordinary Data."""
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    model, closures = closed_tree(rng)
    constraints = ClosedChain(model, closures).constraint_models
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    v, a = rng.normal(size=(2, model.nv))
    forces = pin.StdVec_Force()
    for _ in range(model.njoints):
        forces.append(pin.Force(rng.normal(size=6)))
    own, plain = (results(model, constraints, data, q, v, a, forces) for data in (compact_data(model), pin.Data(model)))
    for name, value in plain.items():
        assert np.isfinite(value).all(), name
        np.testing.assert_array_equal(own[name], value, err_msg=name)


MEASURED = """
import resource
import pinocchio as pin
from exo_pin.chain.structure.memory.compact_data import data_for

model = pin.Model()
joint = 0
for k in range(200):
    joint = model.addJoint(joint, pin.JointModelRY(), pin.SE3.Identity(), str(k))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
data = data_for(model)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ru_maxrss has other units elsewhere")
def test_peak_memory_is_far_below_the_tensors():
    """Of 200 coordinates Pinocchio's own Data takes 244 MB and more."""
    done = subprocess.run([sys.executable, "-c", MEASURED], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 244.0 / 4.0


def test_another_archive_is_not_used(monkeypatch):
    """If Pinocchio's archive had other numbers than the procedure reproduces, the constructor would be used."""
    model = tree(np.random.default_rng(0), 80, ("hinge",))
    honest = module._archive

    def changed(data, last=""):
        archive = honest(data, last)
        if not last:
            archive.find("nvSubtree")[2].text = "77"
        return archive

    monkeypatch.setattr(module, "_archive", changed)
    assert compact_data(model) is None
    assert data_for(model).M.shape == (model.nv, model.nv)


def test_nested_joints_have_an_ordinary_data():
    """Composite joints are not reproduced; an empty tree neither."""
    model = pin.Model()
    kind = pin.JointModelComposite(pin.JointModelRX())
    kind.addJoint(pin.JointModelRY())
    model.addJoint(0, kind, pin.SE3.Identity(), "two")
    assert compact_data(model) is None
    assert compact_data(pin.Model()) is None
    assert data_for(model).J.shape == (6, 2)


def test_without_a_place_for_temporary_files_pinocchio_makes_the_data(monkeypatch):
    model = tree(np.random.default_rng(0), 70, ("hinge",))
    monkeypatch.setattr(module.tempfile, "tempdir", "/no/such/folder")
    with pytest.raises(OSError, match="/no/such/folder"):
        compact_data(model)
    # A member that a compact Data has not.
    assert data_for(model).staticRegressor.shape == pin.Data(model).staticRegressor.shape
