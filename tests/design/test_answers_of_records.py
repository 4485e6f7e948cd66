"""Answers of the records of a design: arms, joints, frames on the torso and obstacles, as they are stored."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, refused, tried
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.design import CircleDimensions, Limb, LimbBody, Mechanism, WristGeometry
from exo_pin.design.holding_frame import (
    device_mass,
    estimated_cuff,
    frame_parts,
    holding_bars,
    mass_text,
    sleeve_size,
    with_cuff_by_geometry,
)
from exo_pin.design.obstacles import obstacle


def weighs(arm):
    """What an arm weighs, and its parts."""
    own = [[part.mass, part.centre_of_mass, part.device] for part in arm.parts]
    return [arm.mass, arm.centre_of_mass, arm.inertia, arm.device, arm.body_mass, own, arm.inertia_about_origin]


def arms():
    """Arms and persons, their sums and mirror images, and those that are none."""
    wearer = ep.Wearer(1.62, 58.0, "female", elbow_flexion=0.7, payload=0.8)
    own, part = ep.Arm.of_wearer(wearer), ep.Arm(0.6, [0.02, 0.01, -0.2], np.diag([2e-3, 3e-3, 1e-3]), device=True)
    bare = ep.Arm(2.0, [0, 0, -0.3])
    return in_turn(
        {
            "of a person": lambda: weighs(own),
            "in degrees": lambda: (
                ep.Arm.from_anthropometry(1.62, 58.0, "female", 40.0, 0.8, degrees=True).centre_of_mass
            ),
            "with a device": lambda: weighs((own + part).mirrored()),
            "of another": lambda: weighs(own.with_device_of(replace(own, body_mass=None, wearer=None) + part)),
            "of no other": lambda: own.with_device_of(None).mass,
            "sum": lambda: (bare + part).inertia,
            "person of a device": lambda: (part.person, weighs((own + part).person)),
            "about O": lambda: weighs(
                ep.Arm.from_inertia_about_origin(0.6, [0.02, 0.01, -0.2], np.diag([0.03, 0.03, 0.004]), True)
            ),
            "no inertia": lambda: bare.inertia_about_origin,
            "weight": lambda: own.weight_moment([0.0, 3.0, -9.0]),
            "no sum": lambda: str(bare.__add__(3)),
            "two persons": lambda: own + ep.Arm.of_wearer(ep.Wearer(1.7, 70, "male")),
            "grams": lambda: ep.Arm(101.0, [0, 0, -0.3]),
            "millimetres": lambda: ep.Arm(1.0, [0, 0, -3.1]),
            "g mm2": lambda: ep.Arm(1.0, [0, 0, -0.3], np.diag([9.1, 9.1, 9.1])),
            "not symmetric": lambda: ep.Arm(1.0, [0, 0, -0.3], [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]),
            "no body": lambda: ep.Arm(1.0, [0, 0, -0.3], np.diag([1.0, 1.0, 2.1])),
            "no wearer": lambda: ep.Arm(1.0, [0, 0, -0.3], wearer=3),
            "nobody": lambda: ep.Arm.of_wearer(3),
            "wearer": lambda: (wearer, wearer.dimensions(), len(wearer.segments())),
            "man": lambda: ep.Wearer(1.9, 100.0, "male", clothing=0.01, arm_girth=0.36).dimensions(),
            "drawn": lambda: [str(each) for each in ep.Wearer.drawn(3, 5)],
            "centimetres": lambda: ep.Wearer(162.0, 58.0, "female"),
            "small": lambda: ep.Wearer(0.49, 58.0, "female"),
            "light": lambda: ep.Wearer(1.62, 2.9, "female"),
            "smallest": lambda: ep.Wearer(0.5, 3.0, "female", arm_girth=0.1, elbow_flexion=-0.3),
            "largest": lambda: ep.Wearer(
                2.6, 400.0, "male", arm_girth=0.8, elbow_flexion=2.8, clothing=0.05, payload=12.0
            ),
            "strongest": lambda: ep.Wearer(2.6, 400.0, "male", payload=12.1),
            "metres?": lambda: refused(
                *(lambda high=high: ep.Wearer(high, 58.0, "male") for high in (49, 50, 260, 261))
            ),
            "heavy": lambda: ep.Wearer(1.62, 401.0, "female"),
            "sex": lambda: ep.Wearer(1.62, 58.0, "woman"),
            "elbow": lambda: ep.Wearer(1.62, 58.0, "female", elbow_flexion=2.9),
            "elbow back": lambda: ep.Wearer(1.62, 58.0, "female", elbow_flexion=-0.31),
            "elbow in degrees": lambda: ep.Wearer(1.62, 58.0, "female", elbow_flexion=40.0, degrees=True).elbow_flexion,
            "clothing": lambda: ep.Wearer(1.62, 58.0, "female", clothing=2.0),
            "thick": lambda: ep.Wearer(1.62, 58.0, "female", arm_girth=0.81),
            "thin": lambda: ep.Wearer(1.62, 58.0, "female", arm_girth=0.09),
            "payload": lambda: ep.Wearer(1.62, 58.0, "female", payload=-1.0),
        }
    )


POINTS = np.array([[0.1, 0.2, 0.05], [-0.12, 0.18, 0.1], [0.03, 0.21, -0.1], [0.2, 0.1, 0.12]])


ENDS = np.array([[0.08, 0.02, -0.2], [-0.05, 0.07, -0.22], [0.01, -0.09, -0.19], [0.06, 0.05, -0.25]])


def geometries():
    """Joint centres on circles and points, with their frames, and those that are none."""
    circles = WristGeometry.from_circles(0.14, 0.12, 0.08, 0.20, np.radians([30, 60, 120]))
    points = WristGeometry(POINTS, ENDS, neutral=Rotation.from_rotvec([0.1, -0.2, 0.3]))
    split = WristGeometry.from_circles(0.14, 0.12, 0.08, 0.20, [0.5, 1.0, 2.0], [0.4, 1.1, 2.2], "right")
    turned = points.replace(base_axis=[0.1, 1.0, 0.2], platform_axis=[0.0, 0.1, 1.0])
    nearly = WristGeometry(POINTS, np.r_[ENDS[:3], [[-0.2, -0.1, -0.12 + 3.17e-10]]])

    def of(geometry):
        names = ("base_points", "platform_points", "base_frames", "platform_frames", "base_axis", "platform_axis")
        return {name: getattr(geometry, name) for name in names} | {
            "more": [geometry.platform_radius, geometry.limb_count, geometry.neutral, str(geometry.circles)]
        }

    return in_turn(
        {
            "circles": lambda: of(circles),
            "on the right": lambda: of(circles.mirrored()),
            "split": lambda: of(split),
            "points": lambda: of(points),
            "mirrored": lambda: of(points.mirrored()),
            "turned": lambda: of(turned.mirrored()),
            "wider": lambda: of(circles.replace(r_A=0.15, alpha_A=[0.3, 1.0, 2.0])),
            "wider apart": lambda: of(
                split.replace(alpha_A=[0.3, 1.0, 2.0], neutral=Rotation.from_rotvec([0, 0.1, 0]))
            ),
            "elsewhere": lambda: of(circles.replace(base_points=POINTS[:3])),
            "both": lambda: circles.replace(base_points=POINTS[:3], r_A=0.1),
            "no circle": lambda: points.replace(r_A=0.1),
            "colour": lambda: points.replace(colour=0.1),
            "fewer": lambda: WristGeometry(POINTS, ENDS[:3]),
            "two": lambda: WristGeometry(POINTS[:2], ENDS[:2]),
            "far": lambda: WristGeometry(POINTS * 30.0, ENDS),
            "at O": lambda: WristGeometry(POINTS * [[1], [1], [0], [1]], ENDS),
            "folded": lambda: WristGeometry(POINTS, np.r_[ENDS[:3], -POINTS[3:]]),
            "nearly folded": lambda: of(nearly)["more"],
            "frames of it": lambda: [
                np.abs(own.transpose(0, 2, 1) @ own - np.eye(3)).max() < 1e-12
                for own in (nearly.base_frames, nearly.platform_frames)
            ],
            "on its axis": lambda: WristGeometry(POINTS, ENDS, base_axis=POINTS[1], platform_axis=[0, 0, 1]),
            "no axis": lambda: WristGeometry(POINTS, ENDS, base_axis=[0, 0, 0]),
            "degrees": lambda: CircleDimensions(0.1, 0.1, 0.1, 0.2, [30.0, 60.0, 90.0], [30.0, 60.0, 90.0]),
            "full turn": lambda: tried(
                lambda more: CircleDimensions(0.1, 0.1, 0.1, 0.2, [1.0, 2 * np.pi + more], [1.0, 2.0]).alpha_A,
                0.9e-9,
                1.1e-9,
            ),
            "angles": lambda: CircleDimensions(0.1, 0.1, 0.1, 0.2, [0.3, 0.6, 0.9], [0.3, 0.6]),
            "side": lambda: CircleDimensions(0.1, 0.1, 0.1, 0.2, [0.3, 0.6, 0.9], [0.3, 0.6, 0.9], "up"),
            "radius": lambda: CircleDimensions(0.0, 0.1, 0.1, 0.2, [0.3, 0.6, 0.9], [0.3, 0.6, 0.9]),
        }
    )


def frames():
    """Bars, sleeve and masses that could hold joints: about given axes, near the shoulder, far apart, on circles."""
    points = WristGeometry(POINTS, ENDS)
    turned = points.replace(base_axis=[0.3, -1.0, 0.2], platform_axis=[-0.6, 0.1, -0.5])
    near, far = (WristGeometry(POINTS, ENDS * size) for size in ([1.0, 1.0, 0.2], [0.3, 0.25, 1.4]))
    circles = WristGeometry.from_circles(0.14, 0.12, 0.08, 0.20, np.radians([30, 60, 120]))

    def of(geometry):
        cuff, ways = estimated_cuff(geometry), [line for lines in holding_bars(geometry) for line in lines]
        ends = [(len(line), line[0], line[len(line) // 3], line[-1]) for line in ways]
        return ends, frame_parts(geometry), sleeve_size(geometry.platform_points), weighs(cuff)

    worn = ep.load("four-linear-actuators-worn").mechanism
    heavy = worn.replace(limbs=[replace(limb, base_body=LimbBody.rod(0.2, 0.4, 0.01)) for limb in worn.limbs])
    named = {
        "points": points,
        "turned": turned,
        "near": near,
        "far": far,
        "circles": circles,
        "right": turned.mirrored(),
    }
    return {name: of(each) for name, each in named.items()} | {
        "right": of(turned.mirrored()),
        "masses": [(device_mass(each), mass_text(each)) for each in (worn, heavy)],
        "own cuff": weighs(with_cuff_by_geometry(worn).arm),
    }


def obstacles():
    """Capsules of what stands about a woman in a coat, and what does not."""
    wearer = ep.Wearer(1.62, 58.0, "female", clothing=0.01)

    def of(name):
        rows = obstacle(name, wearer)
        return len(rows), rows[:2], rows[len(rows) // 2], rows[-3:]

    names = ("chair", "wheelchair", "car", "bed", "door", "wall:120", "ceiling:35", "wall:9999.9")
    return tried(of, *names, "tree", "wall:x", "door:-1", "bed:10000", "wall:nan", 3)


def joints():
    """Shoulders and interfaces, their mirror images and ranges, and those that are none."""
    K = np.diag([5e4, 6e4, 7e4, 800.0, 900.0, 700.0])
    K[0, 4] = K[4, 0] = 300.0
    soft = ep.Interface(K, (0.01, 0.02, -0.2), "a book")
    skew, weak = K.copy(), K.copy()
    skew[0, 1] = 100.0
    weak[0, 1] = weak[1, 0] = 6e4
    stiff = np.array([[2e4, 3e3, 0], [3e3, 1e4, 0], [0, 0, 1.5e4]])
    shoulder = ep.Shoulder(np.radians(90.0), np.radians(95.0), stiff)
    poses = ep.shoulder_rotation(
        [0, 20, 90, 60, 170, 0], [0, 80, 40, 110, 5, 150], [0, 20, -50, 60, 0, 170], degrees=True
    )
    wrench = np.array([[10.0, 3.0, -5.0, 0.5, 0.2, 0.1]])
    return in_turn(
        {
            "shoulder": lambda: (shoulder, shoulder.mirrored().stiffness),
            "of a number": lambda: ep.Shoulder(stiffness=2e4).stiffness,
            "free": lambda: ep.Shoulder(stiffness=0.0).stiffness,
            "skew": lambda: ep.Shoulder(stiffness=stiff + np.diag([10.0, 0.0], 1)),
            "negative": lambda: ep.Shoulder(stiffness=[[1, 2, 0], [2, 1, 0], [0, 0, 1]]),
            "no range": lambda: ep.Shoulder(half_diagonal=0.0),
            "interface": lambda: (soft, soft.mirrored(), soft.slip(wrench, poses[:1].as_matrix())),
            "cuff": lambda: ep.Interface.upper_arm_cuff(0.17, 2.0),
            "plain": lambda: ep.Interface.of(1e4, [3.0, 2.0, 1.0], (0, 0, -0.1)).stiffness,
            "not symmetric": lambda: ep.Interface(skew),
            "weak": lambda: ep.Interface(weak),
            "loose": lambda: ep.Interface(np.diag([1, 1, 1, 1, 1, 0.0])),
            "far": lambda: ep.Interface(K, (0, 0, -2.1)),
            "no source": lambda: ep.Interface(K, source=3),
            "no spring": lambda: ep.Interface.of(0.0, 1.0),
            "interfaces": lambda: (
                ep.Interfaces(soft, None, 0.01).mirrored().harness.at,
                ep.Interfaces().are_rigid,
                ep.Interfaces(cuff=soft).are_rigid,
            ),
            "area": lambda: ep.Interfaces(cuff_area=0.11),
            "no cuff": lambda: ep.Interfaces(cuff=3),
        }
    )


def records():
    """Designs as records: changed, mirrored, and those that are none."""
    own = ep.load("prototype").mechanism
    geometry = own.geometry

    def brief(found):
        return [
            found.summary,
            found.side,
            found.gravity,
            dict(found.sources),
            found.estimated,
            found.limbs_are_massless,
        ]

    mixed = [Limb(), Limb("SPS"), Limb("SPS", LimbBody.rod(0.1, 0.3, 0.01))]
    return in_turn(
        {
            "own": lambda: [*brief(own), own.radius, own.driven_moments, own.drive_units, own.force_words, own.springs],
            "mixed": lambda: brief(own.replace(limbs=mixed)),
            "another arm": lambda: brief(own.replace(arm=ep.Arm(3.0, [0, 0, -0.3]))),
            "moved": lambda: brief(own.replace(geometry=geometry.replace(r_A=0.15)).replace(geometry=geometry)),
            "one limb": lambda: own.replace(limbs=[replace(own.limbs[0], joint_limit=0.5), *own.limbs[1:]]).estimated,
            "four limbs": lambda: brief(Mechanism(geometry).replace(geometry=WristGeometry(POINTS, ENDS))),
            "sources": lambda: brief(own.replace(sources={"arm": "a book"}, estimated=["arm"])),
            "right": lambda: brief(own.replace(gravity=[0.3, 0.5, -9.7]).on_side("right")),
            "same side": lambda: own.on_side("left") is own,
            "no side": lambda: own.on_side("up"),
            "other side": lambda: own.replace(side="right"),
            "laid out": lambda: Mechanism(geometry, side="right"),
            "more limbs": lambda: own.replace(limbs=own.limbs[:2]),
            "no limbs": lambda: own.replace(limbs=[3, 4, 5]),
            "gravity": lambda: own.replace(gravity=[0, 0, -9810.0]),
            "name": lambda: own.replace(name=3),
            "no sources": lambda: own.replace(sources={"a": 3}),
            "no estimates": lambda: own.replace(estimated="arm"),
            "measures": lambda: own.replace(measures="arm").measures,
            "no measure": lambda: own.replace(measures=["force"]),
            "no arm": lambda: own.replace(arm=None).require_arm("weight"),
            "no inertia": lambda: own.replace(arm=ep.Arm(3.0, [0, 0, -0.3])).require_arm("motion", inertia=True),
        }
    )


ASKED = {
    "arms": arms,
    "geometries": geometries,
    "joints": joints,
    "frames": frames,
    "obstacles": obstacles,
    "records": records,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
