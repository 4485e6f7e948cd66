"""Answers of the parts of devices and of their files, as they are stored."""

from dataclasses import replace

import device_doors as doors
import numpy as np
from answers import changes, each_of
from asked_in_turn import folder, in_turn, words_and_numbers

import exo_pin as ep
from exo_pin.device import (
    Brake,
    ChainDevice,
    ConstantForce,
    Drive,
    GasSpring,
    GuidedSlide,
    LinearSpring,
    Route,
    RoutePoint,
    SoftLink,
    Spring,
    TableLaw,
)

CABLE = ep.Actuator("cable", pull_limit=250.0, speed_limit=0.3, power_limit=40.0)
MUSCLE = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
LINE = Route.over(("universe", [-0.1, 0.15, 0.2]), ("universe", [0.0, 0.12, 0.05]), ("cuff", [0.02, 0.05, 0.0]))


def laws():
    """Forces, energies and ranges of laws, and what is no law."""
    table = TableLaw((0.1, 0.2, 0.25, 0.4), (3.0, 8.0, 7.0, 20.0))
    gas = GasSpring(100.0, 0.3, 0.2, 1.3)

    def asked(law, *at):
        return law.force(at), law.energy(at), str(law.range), law.source

    return in_turn(
        {
            "constant": lambda: asked(ConstantForce(7.0), -1.0, 0.5),
            "linear": lambda: asked(LinearSpring(50.0, 0.2), 0.1, 0.2, 0.5),
            "pulls": lambda: asked(LinearSpring(50.0, 0.2, only_pulls=True), 0.1, 0.5),
            "gas": lambda: asked(gas, 0.12, 0.3, 0.35),
            "of one temperature": lambda: asked(GasSpring(100.0, 0.3, 0.2), 0.12, 0.3),
            "pressed out": lambda: gas.force([0.2, 0.09]),
            "table": lambda: asked(table, 0.1, 0.13, 0.22, 0.33, 0.4),
            "below": lambda: table.force(0.09),
            "above": lambda: table.energy([0.2, 0.41]),
            "one point": lambda: TableLaw((0.1,), (1.0,)),
            "fewer": lambda: TableLaw((0.1, 0.2), (1.0,)),
            "twice": lambda: TableLaw((0.1, 0.1), (1.0, 2.0)),
            "no stiffness": lambda: LinearSpring(0.0),
            "no gas": lambda: GasSpring(1.0, 0.3, -0.2),
            "no number": lambda: ConstantForce(np.inf),
            "no law": lambda: Spring("a", 3.0, "joint"),
        }
    )


def drives():
    """Drives, brakes and routes, and what is none."""
    stroke = ep.Stroke(0.25, 0.7, 1.1, 0.15)
    cases = {
        "hinge": lambda: Drive("a", "elbow", lower=-3, upper=5, least=0.1, play=0.01),
        "geared": lambda: Drive.geared("a", "elbow", 0.4, 50.0, 300.0, resolution=1e-4),
        "ungeared": lambda: Drive.geared("a", "elbow", 0.4),
        "no gear": lambda: Drive.geared("a", "elbow", 0.4, 0.0),
        "cable": lambda: Drive("a", route=LINE, actuator=CABLE, power_limit=50.0, speed_limit=0.2, least=0.1),
        "narrower": lambda: Drive("a", route=LINE, actuator=CABLE, lower=5.0, upper=180.0, power_limit=30.0),
        "loose": lambda: Drive("a", route=LINE, actuator=replace(CABLE, play=0.002, resolution=1e-4), play=0.001),
        "unlimited": lambda: Drive("a", route=LINE),
        "pushes": lambda: Drive("a", route=LINE, lower=-4.0),
        "muscle": lambda: Drive("a", "slide", pulls=True, actuator=MUSCLE, stroke=stroke, zero_length=0.3),
        "bare stroke": lambda: Drive("a", "slide", pulls=True, stroke=ep.Stroke(0.25, 0.7, 1.1), greatest=0.4),
        "limb": lambda: Drive("a", "slide", pulls=True, zero_length=0.3),
        "greatest": lambda: Drive("a", route=LINE, greatest=0.4),
        "idle": lambda: Drive("a", "slide", pulls=True, actuator=MUSCLE, stroke=stroke).idle(),
        "mirrored": lambda: Drive("a", route=LINE).mirrored().route,
        "mirrored joint": lambda: Drive("a", "b", upper=3.0).mirrored(),
        "brakes": lambda: [str(own.as_drive) for own in (Brake("b", "e", 4.0), Brake("b", "e"), Brake("c", "d", 0.0))],
        "stroke of a hinge": lambda: Drive("a", "elbow", stroke=stroke),
        "actuator of a hinge": lambda: Drive("a", "elbow", actuator=CABLE),
        "length of a hinge": lambda: Drive("a", "elbow", zero_length=0.1),
        "negative length": lambda: Drive("a", "slide", pulls=True, zero_length=-0.1),
        "no name": lambda: Drive("", "elbow"),
        "number": lambda: Drive("a", 3),
        "nowhere": lambda: Drive("a"),
        "both": lambda: Drive("a", "elbow", LINE),
        "no route": lambda: Drive("a", route="line"),
        "falling": lambda: Drive("a", "elbow", lower=3, upper=2.5),
        "shorter": lambda: Drive("a", "elbow", least=0.2, greatest=0.1),
        "no speed": lambda: Drive("a", "elbow", speed_limit=0.0),
        "no power": lambda: Drive("a", "elbow", power_limit=-1.0),
        "no play": lambda: Drive("a", "elbow", play=-0.1),
        "zero play": lambda: Drive("a", "elbow", play=0, resolution=0),
        "nan": lambda: Drive("a", "elbow", upper=np.nan),
        "brake of nothing": lambda: Brake("a", ""),
        "nameless brake": lambda: Brake(None, "elbow"),
        "pushing brake": lambda: Brake("a", "elbow", -1.0),
        "one point": lambda: Route.over(("arm", [0, 0, 0])),
        "no points": lambda: Route(("arm", "torso")),
        "no link": lambda: RoutePoint(""),
        "plane": lambda: RoutePoint("arm", (0.0, 1.0)),
        "soft nothing": lambda: SoftLink("", ep.Interface.of(1.0, 1.0)),
        "soft": lambda: SoftLink("fork", 3.0),
        "no slide": lambda: GuidedSlide(""),
        "guides": lambda: [
            GuidedSlide("s", guide).resists
            for guide in (None, ep.LimbGuide(65.0, 50.0), ep.LimbGuide(65.0, 0.0), ep.LimbGuide(0.0, 50.0))
        ],
    }
    found = in_turn(cases)
    own = [drive for drive in found.values() if isinstance(drive, Drive)]
    found |= {
        name: [str(drive), str(drive.effort_range), str(drive.length_range), drive.kind, drive.guide]
        for name, drive in found.items()
        if isinstance(drive, Drive)
    }
    chain = ep.load("four-cables").device.as_chain()
    pushing = chain.replace(drives=[Drive(own.name, own.joint) for own in chain.drives])
    found |= {"limbs": [device.drive_units for device in (chain, pushing)]}
    return found | {"lack": [(drive.missing_limits(True), drive.missing_limits(False)) for drive in own]}


def hinges(**parts):
    """Three hinges on the arm, with other parts, and what they carry."""
    return doors.shipped("serial-y-x-z").replace(**parts)


def without_data():
    """Springs that do not cover a pose, in hinges and along routes, with and without ends."""
    exo = hinges()
    joints = [drive.joint for drive in exo.device.drives]
    poses = exo.pose([10.0, 60.0, 80.0], [20.0, 40.0, 10.0], 5.0)
    at = np.linalg.norm(np.array([0.1, 0.2, 0.3]))
    to_arm = Route.over(("universe", [0.0, 0.2, 0.3]), (exo.chain.roles.arm, [0.0, 0.02, -0.25]))
    on_itself = Route.over(
        ("universe", [0.1, 0.2, 0.3]), ("universe", [0.1, 0.2, 0.3]), (exo.chain.roles.arm, [0, 0, -0.2])
    )
    table = TableLaw((-0.1, 0.05, 0.3), (-2.0, 1.0, 4.0))
    end = float(exo.inverse_kinematics(poses).positions[1, 0])

    def asked(*springs, rows=slice(None), **more):
        answer = exo.replace(springs=springs, **more).reaction(poses[rows])
        return answer.status, str(answer), answer.shoulder_force, answer.actuator_forces

    return in_turn(
        {
            "angle": lambda: asked(Spring("bow", table, joints[0])),
            "one pose": lambda: asked(Spring("bow", table, joints[0]), rows=1),
            "other joint": lambda: asked(Spring("bow", table, joints[1])),
            "short": lambda: asked(Spring("strut", GasSpring(60.0, 0.7, 0.15), route=to_arm)),
            "gas": lambda: asked(Spring("strut", GasSpring(60.0, 0.7, 0.4), route=to_arm)),
            "length": lambda: asked(Spring("strut", TableLaw((at, 0.55), (1.0, 3.0)), route=to_arm)),
            "two": lambda: asked(
                Spring("strut", TableLaw((0.1, 0.2), (1, 3)), route=to_arm), Spring("bow", table, joints[0])
            ),
            "no way": lambda: asked(Spring("strut", ConstantForce(5.0), route=on_itself)),
            "no force": lambda: asked(Spring("strut", ConstantForce(0.0), route=on_itself)),
            "slack": lambda: asked(Spring("strut", LinearSpring(50.0, 2.0, True), route=on_itself)),
            "no drive": lambda: asked(drives=(*exo.device.drives, Drive("cable", route=on_itself, upper=30.0))),
            "hinge and way": lambda: asked(
                Spring("spiral", LinearSpring(3.0, 0.2), joints[2]),
                Spring("strut", LinearSpring(90.0, 0.1), route=to_arm),
            ),
            "brake": lambda: asked(drives=exo.device.drives[:2], brakes=[Brake("lock", joints[2], 6.0)]),
            "too few": lambda: asked(drives=exo.device.drives[:2]),
            "cable": lambda: asked(drives=(*exo.device.drives, Drive("cable", route=to_arm, upper=30.0, least=0.45))),
            "nearly": lambda: asked(
                Spring("bow", TableLaw((-3.0, 0.0, end - 2e-5), (-2.0, 1.0, 4.0)), joints[0]), rows=1
            ),
        }
    )


def refused():
    """Devices that cannot be made, and changes of one."""
    device = hinges().device
    joint, arm = device.drives[0].joint, device.chain.roles.arm
    spring, to_leg = ep.Interface.of(1e5, 500.0), Route.over(("arm", [0, 0, 0]), ("leg", [0, 0, 1]))
    link = next(
        frame.name for frame in device.chain.model.frames if frame.parentJoint == 2 and "BODY" in str(frame.type)
    )
    wrist = ep.load("prototype")
    own = wrist.device.as_chain()

    def brief(found):
        return (
            None
            if found is None
            else [found.side, str(found.drives), str(found.springs), found.gravity, found.soft_links]
        )

    soft = device.replace(soft_links=[SoftLink(link, ep.Interface.of(1e4, 50.0, at=(0.1, 0.02, 0.0)))])
    sprung = device.replace(springs=[Spring("a", LinearSpring(3.0), joint)], sources={"a": "b"}, title="two words")
    guided = own.replace(
        guided_slides=[GuidedSlide("limb_1_slide", ep.LimbGuide(65.0, 50.0)), GuidedSlide("limb_2_slide")]
    )
    return in_turn(
        {
            "ball": lambda: device.replace(drives=[Drive("a", device.arm_joint)]),
            "unknown": lambda: device.replace(springs=[Spring("a", LinearSpring(3.0), "b")]),
            "unknown link": lambda: device.replace(drives=[Drive("a", route=to_leg)]).holds_alone,
            "twice": lambda: device.replace(brakes=[Brake(joint, joint)]),
            "no drive": lambda: device.replace(drives=[3]),
            "soft arm": lambda: device.replace(soft_links=[SoftLink(arm, spring)]),
            "soft torso": lambda: device.replace(soft_links=[SoftLink("universe", spring)]),
            "soft twice": lambda: device.replace(soft_links=[SoftLink(link, spring)] * 2),
            "field": lambda: device.replace(colour=3),
            "gravity": lambda: brief(device.replace(gravity=[0.5, 0.0, -9.7])),
            "no gravity": lambda: device.replace(gravity=[0.0, -9.7]),
            "side": lambda: device.replace(side="right"),
            "mirrored": lambda: brief(sprung.mirrored()),
            "soft mirrored": lambda: brief(soft.mirrored()),
            "stiffer links": lambda: brief(soft.stiffened("links", 3.0)),
            "no links": lambda: device.stiffened("links", 3.0),
            "no guides": lambda: device.stiffened("guides", 3.0),
            "stiffer guides": lambda: guided.stiffened("guides", 3.0).guided_slides,
            "no chain": lambda: ChainDevice.from_chain("chain"),
            "wearer": lambda: device.replace(drives=device.drives[:2]).moment_of_wearer(np.arange(10.0).reshape(2, 5)),
            "no wearer": lambda: device.moment_of_wearer(np.ones((2, 3))),
            "flat": lambda: device.moment_of_wearer(np.ones(3)),
            "alone": lambda: str(device.replace(drives=device.drives[:2]).limbs),
            "no arm": lambda: device.replace(arm=None).require_arm("weight"),
            "no inertia": lambda: device.replace(arm=ep.Arm(3.0, [0, 0, -0.3])).require_arm("motion", inertia=True),
            "guide elsewhere": lambda: guided_on(device, joint),
            "guide twice": lambda: guided_on(own, "limb_1_slide", "limb_1_slide"),
            "guided spring": lambda: guided_on(
                own.replace(springs=[Spring("a", LinearSpring(3.0), "limb_1_slide")]), "limb_1_slide"
            ),
            "pushed guide": lambda: guided_on(
                own.replace(drives=[Drive("limb_1_slide", "limb_1_slide")]), "limb_1_slide"
            ),
            "guided": lambda: guided_on(own, "limb_1_slide", "limb_3_slide"),
            "of the wrist": lambda: (wrist.device.stiffened("links", 2.0), wrist.device.stiffened("guides", 2.0)),
            "of no device": lambda: ep.ShoulderExo.from_device(3),
        }
    )


def guided_on(device, *slides):
    """Forces of a device with guides on some of its slides."""
    tube = ep.LimbGuide(65.0, 50.0)
    own = device.replace(
        guided_slides=[GuidedSlide(slide, tube) for slide in slides], shoulder=ep.Shoulder(stiffness=2e4)
    )
    exo = ep.ShoulderExo.from_device(own)
    answer = exo.reaction(exo.pose(30, 20), split="elastic", centre_offset=[0.0, 0.002, 0.006], limits="none")
    return answer.status, answer.shoulder_force, answer.actuator_forces, answer.centre_displacement, answer.cuff_wrench


def reloaded(name, *endings):
    """Files of a device in some formats, and the device that they are read as."""
    exo, angles = doors.device_of(name)
    found = {}
    with folder() as place:
        for ending in endings:

            def asked(ending=ending):
                files = exo.export(f"own{ending}")
                again = ep.load("own.device.toml")
                model = again.chain.model
                return {
                    "files": [file.name for file in files],
                    "statement": files.statement,
                    "text": words_and_numbers((place / "own.device.toml").read_text(encoding="utf-8")),
                    "again": repr(again),
                    "limits": [
                        str(own.tolist())
                        for own in (model.lowerEffortLimit, model.upperEffortLimit, model.upperVelocityLimit)
                    ],
                    "roles": again.chain.roles,
                    "forces": again.reaction(again.pose(*angles[:, 1]), limits="none").shoulder_force,
                }

            found |= in_turn({ending: asked})
        found |= in_turn({"saved": lambda: exo.save("saved.toml"), "again": lambda: repr(ep.load("saved.toml"))})
        found |= in_turn({"no arm": lambda: exo.replace(arm=None).export("bare.xml").statement})
    return found


ASKED = {
    "laws": laws,
    "drives": drives,
    "without_data": without_data,
    "refused": refused,
    "files_of_hinges": lambda: reloaded("handed-1", ".urdf", ".xml", ".sdf"),
    "files_of_limbs": lambda: reloaded("handed-4", ".urdf", ".xml", ".sdf"),
    "files_of_links": lambda: reloaded("handed-8", ".urdf", ".xml", ".sdf"),
    "files_of_a_ball": lambda: reloaded("handed-10", ".urdf", ".xml", ".sdf"),
    "files_of_a_wrist": lambda: reloaded("four-cables", ".urdf", ".xml", ".sdf"),
}

#: Those that take longer than 0.15 s.
LONGER = set(ASKED) - {"laws", "drives"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
