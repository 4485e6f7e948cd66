"""Large chains to measure: robots with the legs and loops of Cassie, and ladders of any number of loops."""

from pathlib import Path

import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain, Closure, Closures

__all__ = ["cassie", "cassies", "ladder", "state_of"]

#: A body: 1 kg, as large as a rod of 0.3 m.
BODY = pin.Inertia(1.0, np.array([0.02, -0.01, -0.15]), np.diag([0.01, 0.009, 0.002]))


def at(x=0.0, y=0.0, z=0.0):
    """A placement without rotation."""
    return pin.SE3(np.eye(3), np.array([x, y, z], dtype=float))


def add(model, parent, kind, place, name):
    """A joint with its body and a frame of the same name."""
    joint = model.addJoint(parent, kind, place, name)
    model.appendBodyToJoint(joint, BODY, pin.SE3.Identity())
    model.addFrame(pin.Frame(name, joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return joint


def frame(model, joint, place, name):
    """A frame on a body."""
    model.addFrame(pin.Frame(name, joint, 0, place, pin.FrameType.OP_FRAME))
    return name


def cassies(count):
    """Robots with the topology of Cassie: a flying pelvis, two legs with a heel rod and a rod to the toe each.

    nv = 30 a robot, with four spherical closures of which the two of the toes' planar loops have a redundant row.
    """
    model, closures = pin.Model(), []
    Y, Z, X = pin.JointModelRY, pin.JointModelRZ, pin.JointModelRX
    for r in range(count):
        pelvis = add(model, 0, pin.JointModelFreeFlyer(), at(y=3.0 * r), f"pelvis_{r}")
        for side, sign in (("left", 1.0), ("right", -1.0)):
            name = f"{side}_{r}"
            roll = add(model, pelvis, X(), at(y=0.13 * sign), f"roll_{name}")
            yaw = add(model, roll, Z(), at(z=-0.05), f"yaw_{name}")
            pitch = add(model, yaw, Y(), at(z=-0.05), f"pitch_{name}")
            # The heel rod: from the thigh to the tarsus, beside knee and shin.
            knee = add(model, pitch, Y(), at(x=0.1, z=-0.3), f"knee_{name}")
            shin = add(model, knee, Y(), at(x=0.05, z=-0.1), f"shin_{name}")
            tarsus = add(model, shin, Y(), at(x=-0.1, z=-0.35), f"tarsus_{name}")
            heel = frame(model, tarsus, at(x=-0.1, z=0.02), f"heel_{name}")
            # The toe's rod: a four-bar of crank, rod, foot and tarsus.
            crank = add(model, tarsus, Y(), at(x=0.05, z=-0.03), f"crank_{name}")
            rod = add(model, crank, Y(), at(x=0.06, z=-0.02), f"rod_{name}")
            rod_end = frame(model, rod, at(x=0.12, z=-0.33), f"rod_end_{name}")
            foot = add(model, tarsus, Y(), at(x=0.1, z=-0.4), f"foot_{name}")
            toe = frame(model, foot, at(x=0.13, z=0.02), f"toe_{name}")
            heel_rod = add(model, pitch, pin.JointModelSpherical(), at(y=0.02 * sign), f"heel_rod_{name}")
            # In the thigh's axes at zero, where the heel is.
            end = frame(model, heel_rod, at(x=-0.05, y=-0.02 * sign, z=-0.73), f"heel_rod_end_{name}")
            closures.append(Closure(f"heel_{name}", "spherical", end, heel))
            closures.append(Closure(f"toe_{name}", "spherical", rod_end, toe))
    return ClosedChain(model, Closures("cassies", closures=tuple(closures)))


def cassie():
    """The real Cassie, cassie_v2.sdf of example-robot-data, which comes with pin; None if it is not there."""
    folders = (Path(pin.__file__).parents[3] / "share", *Path(pin.__file__).parents)
    name = Path("example-robot-data") / "robots" / "cassie_description" / "robots" / "cassie_v2.sdf"
    paths = [path for folder in folders for path in (folder / name, folder / "cmeel.prefix" / "share" / name)]
    found = next((path for path in paths if path.exists()), None)
    return None if found is None else ClosedChain.from_sdf(found, right_angle_tolerance=2e-5)


def ladder(loops):
    """A planar ladder of four-bars, each standing on the one before: 3 coordinates and a closure a loop."""
    model, closures = pin.Model(), []
    Y = pin.JointModelRY
    below = 0
    for k in range(loops):
        place = at() if k == 0 else at(x=-0.02, z=0.02)
        rail = add(model, below, Y(), place, f"rail_{k}")
        rung = add(model, rail, Y(), at(x=0.02, z=0.25), f"rung_{k}")
        other = add(model, rung, Y(), at(x=0.35, z=0.03), f"other_{k}")
        tip = frame(model, other, at(x=0.03, z=-0.28), f"tip_{k}")
        foot = frame(model, below, place * at(x=0.4), f"foot_{k}")
        closures.append(Closure(f"loop_{k}", "spherical", tip, foot))
        below = rung
    return ClosedChain(model, Closures("ladder", closures=tuple(closures)))


def state_of(chain, seed=0):
    """A random motion near the zero configuration that keeps the loops closed, and random efforts."""
    rng = np.random.default_rng(seed)
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.02, 0.02, chain.model.nv)))
    v = chain.project_velocity(q, 0.1 * rng.normal(size=chain.model.nv))
    return q, v, rng.normal(size=chain.model.nv)
