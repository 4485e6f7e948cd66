"""Random devices with motions that leave the arm where it is, and their equilibrium by virtual work.

Nothing here asks the package for a force: the load of a motion is the change of potential energy along it, by central
differences of centres of mass, and the motions are those along which the ends of every loop stay together, by central
differences of where these ends are.
"""

import numpy as np
import pinocchio as pin
import scipy

import exo_pin as ep
from exo_pin.device import Brake, ChainDevice, Drive

STEP = 1e-5
#: Rounding of these differences, over the largest load.
NOTHING = 1e-8


class Builder:
    """A device on an arm, joint by joint; every link has a mass of its own."""

    def __init__(self, rng):
        self.rng, self.model, self.loops, self.drives, self.brakes = rng, pin.Model(), [], [], []
        self.model.gravity.linear = np.array([0.0, 0.0, -9.81])
        ball = pin.JointModelSpherical()
        self.arm = self.add(0, ball, np.zeros(3), "shoulder", 4.0, np.array([0.02, -0.03, -0.3]), "arm")

    def add(self, parent, kind, at, name, mass, centre, link=None, axes=None):
        place = pin.SE3(np.eye(3) if axes is None else axes, np.asarray(at, dtype=float))
        index = self.model.addJoint(parent, kind, place, name)
        inertia = pin.Inertia(mass, np.asarray(centre, dtype=float), 1e-3 * np.eye(3))
        self.model.appendBodyToJoint(index, inertia, pin.SE3.Identity())
        frame = pin.Frame(link or f"{name}_link", index, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        self.model.addFrame(frame, False)
        return index

    def unit(self):
        found = self.rng.normal(size=3)
        return found / np.linalg.norm(found)

    def near(self, size):
        return self.rng.uniform(-size, size, 3)

    def drive(self, joint, limit):
        self.drives.append(Drive(joint, joint, lower=-limit, upper=limit))

    def hinges(self, count, driven):
        """Hinges through O in series, the last link fixed to the arm."""
        parent, axes = 0, []
        for k in range(count):
            axis = self.unit()
            while axes and abs(axis @ axes[-1]) > 0.7:
                axis = self.unit()
            axes.append(axis)
            kind = pin.JointModelRevoluteUnaligned(*axis)
            parent = self.add(parent, kind, np.zeros(3), f"hinge_{k + 1}", self.rng.uniform(0.3, 1.5), self.near(0.2))
            if driven[k]:
                self.drive(f"hinge_{k + 1}", self.rng.choice([8.0, 30.0, 200.0]))
        self.loops.append(ep.chain.Closure("frame", "rigid", f"hinge_{count}_link", "arm"))

    def limbs(self, count, carrier="arm", off_axis=0.0):
        """Limbs with a slide between two balls, from the torso to a link: each spins freely about its own axis."""
        for k in range(count):
            angle = 2.0 * np.pi * (k + 0.3 * self.rng.uniform()) / count
            base = np.array([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0.15]) + self.near(0.08)
            end = np.array([0.08 * np.cos(angle + 0.9), 0.08 * np.sin(angle + 0.9), -0.2]) + self.near(0.05)
            along = end - base
            z = along / np.linalg.norm(along)
            x = np.cross(z, self.unit())
            x /= np.linalg.norm(x)
            axes = np.column_stack([x, np.cross(z, x), z])
            ball, slide = pin.JointModelSpherical(), pin.JointModelPZ()
            tube = self.add(0, ball, base, f"ball_{k + 1}", 0.3, [off_axis, 0.0, 0.1], axes=axes)
            name = f"slide_{k + 1}"
            self.add(tube, slide, [0.0, 0.0, np.linalg.norm(along)], name, 0.2, [0.0, 0.0, -0.05])
            self.drive(name, self.rng.choice([30.0, 150.0, 800.0]))
            place = ep.chain.Placement(tuple(end.tolist()))
            if carrier != "arm":
                place = ep.chain.Placement((end - self.ring).tolist())
            self.loops.append(
                ep.chain.Closure(f"end_{k + 1}", "spherical", f"{name}_link", carrier, ep.chain.Placement(), place)
            )

    def slipping_ring(self):
        """A ring that slides along the arm, to which limbs go."""
        self.ring = np.array([0.0, 0.0, -0.2])
        axis = np.array([0.1, 0.05, -1.0])
        kind = pin.JointModelPrismaticUnaligned(*(axis / np.linalg.norm(axis)))
        self.add(self.arm, kind, self.ring, "ring", 0.4, self.near(0.03))

    def appendage(self, kind):
        """A slide of its own on the torso: level (nothing loads it), upright and driven, braked or held by nobody."""
        axis = [1.0, 0.0, 0.0] if kind == "level" else self.unit() * [1.0, 1.0, 0.2] + [0.0, 0.0, 0.8]
        slide = pin.JointModelPrismaticUnaligned(*(np.array(axis) / np.linalg.norm(axis)))
        self.add(0, slide, [0.4, 0.2, 0.1], "extra", self.rng.uniform(0.5, 2.0), self.near(0.1))
        if kind == "driven":
            self.drive("extra", 60.0)
        elif kind == "braked":
            self.brakes.append(Brake("extra_brake", "extra", 60.0))

    def device(self):
        roles = ep.chain.Roles(arm="arm", shoulder="shoulder")
        chain = ep.ClosedChain(self.model, ep.chain.Closures("random", closures=tuple(self.loops), roles=roles))
        own = ChainDevice.from_chain(chain)
        return own.replace(drives=tuple(self.drives), brakes=tuple(self.brakes))


def random_device(seed):
    """A device with 0 to 3 idle freedoms, and what kind it is."""
    rng = np.random.default_rng(seed)
    build, kind = Builder(rng), ("serial", "limbs", "ring", "both")[seed % 4]
    extra = ("none", "level", "driven", "braked", "loose")[(seed // 4) % 5]
    if kind == "serial":
        count = int(rng.integers(2, 6))
        driven = rng.uniform(size=count) < 0.85
        build.hinges(max(count, 3), [*driven, True, True, True])
    elif kind == "limbs":
        build.limbs(int(rng.integers(2, 5)), off_axis=float(rng.choice([0.0, 0.0, 0.02])))
    elif kind == "both":
        build.hinges(3, [True, True, True])
        build.limbs(int(rng.integers(1, 3)))
    else:
        build.slipping_ring()
        build.limbs(int(rng.integers(3, 6)), "ring_link")
    if extra != "none":
        build.appendage(extra)
    return build.device(), f"{kind}, {extra}"


class VirtualWork:
    """Rows of equilibrium in one configuration: a row for every motion that the loops allow.

    Attributes
    ----------
    efforts, turns, load : ndarray
        Shapes (k, p), (k, 3) and (k,): efforts f and a moment w on the arm balance it where
        ``efforts @ f + turns @ w = load``.
    """

    def __init__(self, device, q):
        chain, self.device = device.chain, device
        self.model = model = chain.model.copy()
        arm = device.arm
        model.inertias[device.arm_index] = pin.Inertia(arm.mass, arm.centre_of_mass, arm.inertia)
        self.data, self.closures = model.createData(), chain.description.closures
        energy, ends = self._slopes(q)
        _, s, Vt = np.linalg.svd(ends)
        rank = int((s > 1e-7 * s[0]).sum()) if s.size else 0
        Z = Vt[rank:].T
        joints = [drive.joint for drive in (*device.drives, *device.brakes)]
        self.efforts = Z[[model.joints[model.getJointId(joint)].idx_v for joint in joints]].T
        first = model.joints[device.arm_index].idx_v
        R = pin.Quaternion(q[model.joints[device.arm_index].idx_q :][:4]).matrix()
        self.turns, self.load, self.scale = (R @ Z[first : first + 3]).T, Z.T @ energy, np.abs(energy).max()

    def _slopes(self, q):
        """Derivatives of potential energy and of the loops' errors, shapes (nv,) and (rows, nv)."""
        ends = [[self._at(q, sign * step) for sign in (1.0, -1.0)] for step in STEP * np.eye(self.model.nv)]
        pairs = [[(a - b) / (2.0 * STEP) for a, b in zip(*end, strict=True)] for end in ends]
        return np.array([energy for energy, _ in pairs]), np.array([error for _, error in pairs]).T

    def _at(self, q, step):
        model, data = self.model, self.data
        there = pin.integrate(model, q, step)
        pin.forwardKinematics(model, data, there)
        energy = 0.0
        for joint in range(1, model.njoints):
            inertia = model.inertias[joint]
            energy += 9.81 * inertia.mass * data.oMi[joint].act(inertia.lever)[2]
        error = []
        for loop in self.closures:
            a, b = (self._end(loop, end) for end in "ab")
            error.append(b.actInv(a.translation))
            if loop.type == "rigid":
                error.append(pin.log3(b.rotation.T @ a.rotation))
        return energy, np.concatenate(error) if error else np.zeros(0)

    def _end(self, loop, end):
        model = self.model
        place = getattr(loop, f"placement_{end}")
        own = pin.XYZQUATToSE3([*place.translation, *place.quaternion])
        frame = model.frames[model.getFrameId(getattr(loop, f"frame_{end}"))]
        return self.data.oMi[frame.parentJoint] * frame.placement * own

    def residual(self, f, w):
        """Largest miss of the rows, over the largest load or effect of an effort."""
        miss = self.efforts @ f + self.turns @ w - self.load
        return np.abs(miss).max() / max(self.scale, np.abs(self.efforts * f).max(initial=0.0), 1e-12)

    def least_moment(self):
        """The least moment of the wearer with which efforts of any size balance the device; None where none does."""
        left = scipy.linalg.null_space(self.efforts.T, rcond=1e-7) if self.efforts.shape[1] else np.eye(len(self.load))
        U, s, Vt = np.linalg.svd(left.T @ self.turns, full_matrices=False)
        kept = s > 1e-7  # motions are of size one; the spin of a limb turns the arm by rounding
        w = Vt[kept].T @ ((U[:, kept].T @ left.T @ self.load) / s[kept])
        miss = np.abs(left.T @ (self.turns @ w - self.load)).max(initial=0.0)
        return None if miss > 1e-7 * self.scale else w

    def shortest(self):
        """Efforts of the drives of least norm without moment of the wearer, then those of the brakes; None if none do.

        Of drives that mix N and N m the norm is that of efforts over limits.
        """
        n, device = len(self.device.drives), self.device
        mixed = len({device.unit_of(drive) for drive in device.drives}) > 1
        limits = np.array([drive.upper if mixed else 1.0 for drive in device.drives])
        brakes, drives = self.efforts[:, n:], self.efforts[:, :n]
        left = scipy.linalg.null_space(brakes.T, rcond=1e-7) if brakes.shape[1] else np.eye(len(self.load))
        f = limits * np.linalg.lstsq(left.T @ drives * limits, left.T @ self.load, rcond=1e-7)[0]
        b, *_ = np.linalg.lstsq(brakes, self.load - drives @ f, rcond=1e-7)
        both = np.concatenate([f, b])
        return both if self.residual(both, np.zeros(3)) < NOTHING else None

    def worst_within(self, lower, upper):
        """Least largest miss of all rows by efforts within limits, without the wearer, over the scale: an LP."""
        k, p = self.efforts.shape
        A, b = self.efforts / self.scale, self.load / self.scale
        rows = np.vstack([np.hstack([A, -np.ones((k, 1))]), np.hstack([-A, -np.ones((k, 1))])])
        bounds = [*zip(lower, upper, strict=True), (0.0, None)]
        cost = np.append(np.zeros(p), 1.0)
        found = scipy.optimize.linprog(cost, A_ub=rows, b_ub=np.concatenate([b, -b]), bounds=bounds, method="highs")
        assert found.status == 0
        return float(found.fun)
