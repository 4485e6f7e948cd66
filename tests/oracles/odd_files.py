"""What uncommon files of robots are read and written as: a table of texts, with names for what they have in common."""

import warnings

import pinocchio as pin
import yaml
from asked_chains import tried
from asked_files import brief, said, written
from places import REPOSITORY
from sdf_arm import ARM
from sdf_robots import LEG
from stewart_sdf import stewart
from urdf_knee import GOOD

from exo_pin.chain import ClosedChain, Closure, Closures, Root

ROWS = yaml.safe_load((REPOSITORY / "tests" / "chain" / "formats" / "odd_files.yaml").read_text(encoding="utf-8"))
PARTS = {"ARM": ARM, "LEG": LEG, "GOOD": GOOD, "TREE": ROWS["tree"]}


def _read(kind, text, options, given):
    for name, part in PARTS.items():
        text = text.replace(name, part)
    closures = tuple(Closure(**own) for own in given.pop("closures", ()))
    beside = Closures("robot", Root(**given.pop("root", {})), closures)
    more = [beside] if kind == "urdf" and "open" not in given else []
    return getattr(ClosedChain, f"from_{kind}")(text, *more, **options)


def read():
    """Each as a chain, or what is said of it."""
    return [said(tried(lambda row=row: brief(_read(*row[:3], dict(row[3]))))) for row in ROWS["read"]]


def one(joint, **arrays):
    """A heavy body on the world."""
    model = pin.Model()
    index = model.addJoint(0, joint, pin.SE3.Identity(), "joint")
    model.addFrame(pin.Frame("body", index, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.appendBodyToJoint(index, pin.Inertia.FromSphere(1.0, 0.1), pin.SE3.Identity())
    for name, values in arrays.items():
        getattr(model, name)[:] = values
    return ClosedChain(model, Closures("one"))


def write():
    """The files of each, or what is said of it."""
    chains = [_read(*row[:3], dict(row[3])) for row in ROWS["written"]]
    ball, hinge = pin.JointModelSpherical, pin.JointModelRX
    chains += [one(pin.JointModelHZ(0.1)), one(ball(), damping=[1.0, 1.0, 2.0]), one(ball(), upperEffortLimit=9.0)]
    chains += [one(hinge(), upperDryFrictionLimit=2.0), one(hinge(), rotorInertia=1.0)]
    chains += [ClosedChain.from_sdf(stewart(lower="universal", upper="universal", moments=1e-3, held=True))]
    with warnings.catch_warnings():
        # Inertias that are mended.
        warnings.simplefilter("ignore", RuntimeWarning)
        return [written(chain, chain.neutral()) for chain in chains]
