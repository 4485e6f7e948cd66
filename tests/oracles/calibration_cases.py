"""Generated calibrations: designs, unknowns, poses, errors of the measurements, and what goes wrong with them."""

from typing import NamedTuple

import numpy as np
from measured_devices import Device, measured, near, poses, random_exo
from scipy.spatial.transform import Rotation

import exo_pin as ep

MOUNTINGS = ("torso_mounting", "arm_mounting")
CENTRE = ("base_offset", "cuff_offset")
JOINTS = ("base_points", "platform_points")
#: Sets of unknowns that lengths determine, up to discrete twins.
UNKNOWNS = (
    JOINTS,
    (*JOINTS, "length_offsets"),
    CENTRE,
    (*CENTRE, "length_offsets"),
    MOUNTINGS,
    ("length_offsets", *MOUNTINGS),
    ("length_offsets", *CENTRE, *MOUNTINGS),
    (*CENTRE, *MOUNTINGS),
    ("base_points",),
    ("platform_points",),
    ("base_points", "cuff_offset"),
    ("base_points", "cuff_offset", "arm_mounting"),
    ("arm_mounting",),
    ("length_offsets", "cuff_offset", "arm_mounting"),
)
KINDS = ("clean", "outliers", "slack", "wrong mounting")
NOISE = 3e-4


class Case(NamedTuple):
    """Arguments of ``calibrate``, and the device that was measured."""

    device: Device
    nominal: ep.ShoulderExo
    poses: Rotation
    lengths: np.ndarray
    options: dict
    kind: str

    def calibrated(self):
        return ep.calibrate(self.poses, self.lengths, self.nominal, **self.options)


def case(seed, kind=None, turned=1.0):
    """A case; mountings that are unknown are anywhere, or with ``turned`` below 1 within so many rad, about."""
    rng = np.random.default_rng([seed, 28])
    nominal = ep.load("prototype") if rng.random() < 0.5 else random_exo(rng, int(rng.integers(3, 6)))
    unknowns = UNKNOWNS[rng.integers(len(UNKNOWNS))]
    kind = KINDS[rng.integers(4)] if kind is None else kind
    device = _built(nominal, unknowns, rng, turned)
    count = int(rng.integers(25, 60))
    arm = poses(rng, count) if rng.random() < 0.7 else Rotation.random(count, rng)
    turn = np.radians(0.1) if rng.random() < 0.25 else 0.0
    seen, lengths = measured(device, arm, rng, NOISE, turn)
    options = {"unknowns": unknowns, "orientation_noise": turn}
    options["length_noise"] = NOISE if turn or rng.random() < 0.6 else None
    if kind == "outliers":
        size = rng.choice([-1, 1], lengths.shape) * rng.uniform(0.01, 0.05, lengths.shape)
        lengths = lengths + (rng.random(lengths.shape) < 0.05) * size
    elif kind == "slack":
        # A slack muscle keeps the length at which it became slack.
        i, share = rng.integers(lengths.shape[1]), rng.uniform(0.05, 0.35)
        lengths[:, i] = np.maximum(lengths[:, i], np.quantile(lengths[:, i], share))
    elif kind == "wrong mounting":
        # Stated wrong by 3° to 57°, or to start from, where it is unknown, anywhere.
        name, axis = MOUNTINGS[rng.integers(2)], rng.normal(size=3)
        wrong = Rotation.from_rotvec(rng.uniform(0.05, 1.0) * axis / np.linalg.norm(axis))
        options[name] = Rotation.random(rng=rng) if name in unknowns else wrong
    return Case(device, nominal, seen, lengths, options, kind)


def _built(nominal, unknowns, rng, turned):
    """A device that differs from the design in what is unknown."""
    n, device = nominal.geometry.limb_count, near(nominal, rng, joints=0.0)

    def mounting(name):
        if name not in unknowns:
            return Rotation.identity()
        if turned < 1.0:
            return Rotation.from_rotvec(turned * rng.normal(size=3))
        aligned = Rotation.create_group("O")[rng.integers(24)] * Rotation.from_rotvec(0.2 * rng.normal(size=3))
        return Rotation.random(rng=rng) if rng.random() < 0.5 else aligned

    rings = {}
    for ring, points, offset in (
        ("base", "base_points", "base_offset"),
        ("platform", "platform_points", "cuff_offset"),
    ):
        moved = 0.004 * rng.normal(size=(n, 3)) * (points in unknowns)
        rings[ring] = getattr(device, ring) + moved + 0.01 * rng.normal(size=3) * (offset in unknowns)
    offsets = 0.05 * rng.normal(size=n) * ("length_offsets" in unknowns)
    return Device(rings["base"], rings["platform"], offsets, mounting("torso_mounting"), mounting("arm_mounting"))


def in_sensors(torso, arm, base, platform):
    """Joints in the frames of the sensors: all that lengths depend on, besides the offsets. Shape (2 n, 3)."""
    return np.concatenate([torso.inv().apply(base), arm.apply(platform)])


def error(found, device, frames=("body", "sensors")):
    """How far a fitted device is from the real one, m: its joints in the body's frames, and in those of the sensors."""
    own, true = (found.joints, (device.base, device.platform))
    apart = {
        "body": np.concatenate(own) - np.concatenate(true),
        "sensors": in_sensors(found.torso_mounting, found.arm_mounting, *own)
        - in_sensors(device.torso, device.arm, *true),
    }
    return max(float(np.abs(apart[frame]).max()) for frame in frames)


def stated_error(found, frames=("body", "sensors")):
    """Largest standard deviation that a calibration states for these joints, m, by differences of their positions."""
    model, step = found.model, 1e-6

    def ends(values):
        joints = model.joints(values)
        parts = {"body": np.concatenate(joints), "sensors": in_sensors(*model.mountings(values), *joints)}
        return np.concatenate([parts[frame] for frame in frames]).ravel()

    rows = [(ends(found.values + dx) - ends(found.values - dx)) / (2.0 * step) for dx in step * np.eye(model.size)]
    return float(np.sqrt(np.diag(found.information.spread(np.transpose(rows)))).max())


def true_values(found, device):
    """The device as changes from where a calibration starts, its joints with what is no offset of their ring."""
    model, values = found.model, np.zeros(found.model.size)
    for points, offset, moved in (
        ("base_points", "base_offset", device.base - model.base),
        ("platform_points", "cuff_offset", device.platform - model.platform),
    ):
        if points in model.places:
            values[model.places[points]] = moved.ravel()
        elif offset in model.places:
            values[model.places[offset]] = moved[0]
    changes = {
        "length_offsets": device.offsets - model.offsets,
        "torso_mounting": (device.torso * model.torso.inv()).as_rotvec(),
        "arm_mounting": (model.arm.inv() * device.arm).as_rotvec(),
    }
    for name, change in changes.items():
        if name in model.places:
            values[model.places[name]] = change
    return values
