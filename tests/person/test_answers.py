"""Answers of the person's room as they are stored: persons, contact forces, ranges, exports, files of loads."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_a_folder, in_digits, in_turn
from contact_results import some_contact
from places import URDF

import exo_pin as ep
from exo_pin.device import Route, Spring, TableLaw
from exo_pin.person import ContactRange, DeviceAction, write_external_loads

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import mujoco
from worn_on_person import PERSON

MAN = ep.Person(1.82, 83.0, "male", elbow_flexion=0.4, forearm_rotation=-0.5, payload=0.7, strength=1.2,
                cuff_strength=0.9, scapular_motion=0.8)  # fmt: skip
WOMAN = ep.Person(1.63, 58.0, "female", side="right")
POSES = ep.shoulder_rotation([20.0, 45.0, 5.0], [35.0, 60.0, 80.0], [5.0, -10.0, 20.0], degrees=True)
RIGHT = ep.shoulder_rotation([20.0, 45.0, 5.0], [35.0, 60.0, 80.0], [5.0, -10.0, 20.0], "right", degrees=True)
#: One within, and two beyond what the model's joints do.
FAR = ep.shoulder_rotation([20.0, -130.0, 60.0], [35.0, 20.0, 10.0], [0.0, 5.0, 120.0], degrees=True)
MOTION = ep.Motion([0.7, -0.4, 0.2], [2.0, 1.0, -3.0])
PUSH = ep.Load([3.0, -2.0, 5.0], [0.1, 0.2, -0.3], at=(0.01, 0.02, -0.4), frame="arm")
LIMBS = (
    np.array([[1.0, 2.0, 9.0, 0.1, -0.3, 0.02], [-2.0, 0.5, 8.0, -0.2, 0.3, 0.1], [0.5, -3.0, 7.0, 0.3, 0.2, -0.1]])
    / 8.0
)
ACTION = DeviceAction(np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.3]), LIMBS, np.array([2.0, 11.0, -4.0]), np.array([60.0,
11.0, 9.0]),
                      side_forces=1, caution="A test.", held=np.array([True, False, True]), drive_units=(("one", "N"),
                      ("two", "N m")))  # fmt: skip


def both(contact):
    """An answer, its columns one by one, of as many decimals as every machine finds, and its sums."""
    columns = [
        (name, np.round(values, 1 if name.endswith("_N") else 3) + 0.0 if values.dtype.kind == "f" else values)
        for name, values in contact.columns().items()
    ]
    return {"contact": contact, "columns": columns, "sums": contact.summary()}


def persons():
    angles = {"elbow_flexion": 95.0, "forearm_rotation": 30.0, "degrees": True}
    folded = ep.Person(1.7, 70.0, "female", side="right", **angles)
    whole = [
        (one, one.arm, one.forearm, one.elbow_centre, one.length_scale, one.strength_scale, one.muscle_table)
        for one in (MAN, WOMAN, folded)
    ]
    made = lambda **given: lambda: ep.Person(1.7, 70.0, "male", **given)  # noqa: E731
    refused = in_turn(
        cuff=made(cuff_strength=0.0), strong=made(strength=10.1), percent=made(cuff_strength=56.0),
        weak=made(strength=-0.1), edge=made(strength=10.0, cuff_strength=10.0, scapular_motion=1.5),
        scapula=made(scapular_motion=1.51), bent=made(elbow_flexion=2.3), stretched=made(elbow_flexion=-0.01),
        just=made(elbow_flexion=np.radians(130.0) + 0.9e-9), over=made(elbow_flexion=np.radians(130.0) + 1.1e-9),
        ends=made(elbow_flexion=130.0, forearm_rotation=-90.0, degrees=True),
        turned=made(forearm_rotation=91.0, degrees=True), side=made(side="up"),
    )  # fmt: skip
    return (
        whole,
        refused,
        MAN.allows(FAR),
        MAN.allows(ep.shoulder_rotation(0.0, [-9.5, -10.5], 0.0, degrees=True)),
        MAN.range_of_motion,
        MAN.limb_state(FAR),
        WOMAN.limb_state(RIGHT[0]),
        MAN.on_side("right").side,
        MAN.centre_path([0.01, 0.0, 0.02]),
        MAN.glenoid_cone(superior=0.5),
        WOMAN.centre_path(),
    )


def contact():
    """Without a device: under every option, with motion and load, for both sides, one too weak and one beyond."""
    options = ep.ContactOptions(
        3, "volume", True, ep.GlenoidCone(superior=0.5, anterior=0.4), "forearm", (0.003, -0.002, 0.004), 0.1
    )
    free = ep.ContactOptions(cone=None)
    weak, feeble = replace(MAN, strength=0.15), replace(MAN, strength=0.0)
    straight = replace(WOMAN, strength=0.0, payload=0.4)
    pushes = [ep.Load([size, 1.0, 2.0], at=(0.0, 0.0, -0.5)) for size in (-40.0, 40.0)]
    loaded = ep.ContactOptions(load_on="forearm")
    nearly = [replace(MAN, elbow_flexion=np.radians(angle)).joint_contact(POSES[0]).force for angle in (0.95, 1.1)]
    need = feeble.joint_contact(POSES[0]).missing_moment
    carried = [feeble.joint_contact(POSES[0], device=[0, 0, 0, *(need * (1 + share * 1e-6))]) for share in (0.95, 1.1)]
    limp = [straight.joint_contact(RIGHT[:2], load=push, options=loaded).missing_elbow for push in pushes]
    return (
        both(MAN.joint_contact(POSES, MOTION, PUSH, options=options)), both(WOMAN.joint_contact(RIGHT[0], load=PUSH,
        options=free, gravity=(1.0, 0.5, -9.0))),
        weak.joint_contact(POSES, load=PUSH), feeble.joint_contact(POSES[:2]), both(feeble.joint_contact(POSES[0],
        device=np.array([0.0, 0.0, 20.0, 1.0, -6.0, 0.3]))),
        limp, nearly, [(each.status, each.held) for each in carried],
        MAN.joint_contact(FAR, outside="mark"), in_turn(outside=lambda: MAN.joint_contact(FAR),
        mark=lambda: MAN.joint_contact(POSES, outside="drop"), one=lambda: WOMAN.joint_contact(FAR[2])),
    )  # fmt: skip


def worn():
    """With a device: forces that are given, bounded and chosen, and what the muscles keep."""
    kept = ep.ContactOptions(kept_activation=0.3, centre_shift=(0.0, 0.01, 0.0))
    return (
        both(MAN.joint_contact(POSES, device=ACTION)), both(WOMAN.joint_contact(RIGHT, device=replace(ACTION,
        least="contact"), options=kept)),
        both(MAN.joint_contact(POSES[1], device=[1.0, 2.0, 11.0, 0.1, -2.0, 0.3])), MAN.joint_contact(POSES[:2],
        device=[[0, 0, 9.0, 0, 0, 0], [0, 0, 8.0, 0, 1.0, 0]], options=ep.ContactOptions(2, "volume")),
        replace(ACTION, held=True).mirrored(), ACTION.about([0.01, -0.02, 0.03]),
    )  # fmt: skip


def of_designs():
    """Contact with the actuators of designs: shares, least efforts, reactions, springs, runs."""
    cables, frame = ep.load("four-cables"), ep.load("prototype").replace(limbs=None)
    support, stack = ep.load(URDF / "spring-support.urdf"), ep.shoulder_rotation([60.0, 80.0], 10.0, 0.0, degrees=True)
    hung = [
        support.joint_contact(one, WOMAN.on_side("left"))
        for one in (
            stack,
            stack[0],
            stack[:1],
            ep.shoulder_rotation(-60.0, 5.0, 0.0, degrees=True),
            ep.shoulder_rotation(0.0, 0.0, 0.0),
        )
    ]
    way = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))
    beyond = support.replace(springs=[Spring("strut", TableLaw((0.285, 0.9), (-30.0, -10.0)), route=way)])
    hung.append(beyond.joint_contact(ep.shoulder_rotation(0.0, 0.0, 0.0), WOMAN.on_side("left")))
    springs = [(each.assumptions, each.force, each.relief_percent, each.cautions) for each in hung]
    pose, man = POSES[:2], replace(MAN, strength=1.0)
    held = frame.joint_contact(pose, replace(man, strength=0.0), 1.0)
    return (
        springs,
        both(frame.joint_contact(pose, man, 0.6, MOTION, PUSH)), cables.joint_contact(pose[0], man, "least_effort",
        load=PUSH), cables.joint_contact(pose[0], man, "least_contact"),
        frame.joint_contact(pose, man, frame.worn_by(man).reaction(pose)), cables.joint_contact(pose[0], man, [11.0,
        7.0, 13.0, 5.0], centre_offset=[0.0, 0.002, 0.01]),
        (held.force, held.status, held.missing_moment, held.missing_elbow, held.kkt, held.held),
    )  # fmt: skip


def words():
    """Verdicts, tables and sums of contact forces that are given, with and without a device."""
    sizes = [300.0, np.nan, 411.0, 398.8]
    bare = some_contact([500.0, 350.0, 380.0, 400.0], side="right")
    states = some_contact([np.nan] * 4, status=["too_weak", "unstable", "no_device_force", "outside"])
    worn = some_contact(
        sizes,
        without_device=bare,
        device_forces=np.arange(8.0).reshape(4, 2),
        drive_units=(("hip", "N m"), ("rope", "N")),
        caution="Beware.",
        record_cautions=("Rough.",),
    )
    single = [
        some_contact(size, without_device=some_contact(other))
        for size, other in ((300.0, 500.0), (500.0, 400.0), (np.nan, 400.0), (400.0, np.nan))
    ]
    lone = [
        some_contact(np.nan, status=name)
        for name in ("too_weak", "unstable", "no_device_force", "outside", "not_solved")
    ]
    whole = [both(each) for each in (worn, some_contact(sizes), states)]
    few, count = np.zeros(len(ep.person.MUSCLES)), len(ep.person.MUSCLES)
    few[[3, 9, 14]] = 0.0105, 0.4, 0.0097
    units = (("hip", "N m"), ("wearer about hip", "N m"), ("rope", "N"), ("knee", "N m"))
    odd = [some_contact(300.0, activations=own) for own in (few, np.linspace(0.02, 0.5, count))]
    odd += [
        some_contact(
            np.nan, status=name, missing_moment=np.array([3.0, -4.0, 0.3]), missing_elbow=np.array([1.0, -2.5])
        )
        for name in ("too_weak", "unstable")
    ]
    given = np.array([-0.04, 3.0, -0.4, -0.06])
    odd += [
        some_contact(300.0, without_device=odd[0], device_forces=given, drive_units=units),
        some_contact(300.0, without_device=odd[1], device_forces=given[2:], constraint_forces=given[:1]),
    ]
    return (
        whole,
        [str(each).splitlines() for each in odd],
        [(each, each.verdict) for each in (*single, *lone)],
        replace(worn, held=np.array([True, True, False, True])).relief_percent,
        bare.peak_row,
        states.mirrored().side,
    )


def told(each):
    """What a range says of itself."""
    return {
        "says": str(each), "least": each.lowest, "most": each.highest, "band": each.band, "relief": each.relief_percent
    }  # fmt: skip


def ranges():
    """Over contact forces that are given, of one pose and of three of which some have no result."""
    sizes = [[300.0, np.nan, np.nan], [250.0, 400.0, np.nan], [500.0, np.nan, np.nan]]
    persons = tuple(some_contact([7.5 * k, np.nan, 7.5 * k if k > 19 else np.nan]) for k in range(10, 31))
    bare = [some_contact(3 * [size]) for size in (600.0, 900.0, 800.0)]
    alone, worn = (
        [some_contact(size, without_device=other) for size, other in zip(sizes, others, strict=True)]
        for others in (3 * [None], bare)
    )
    single = ContactRange(some_contact(150.0), {"none": some_contact(np.nan)}, (some_contact(150.0),))
    made = [ContactRange(one, {"first": two, "second": three}, persons) for one, two, three in (alone, worn)]
    return [told(each) for each in (*made, single)]


def over_assumptions():
    """Ranges over all assumptions, alone and with a device."""
    options = ep.ContactOptions(3, "volume", True, socket_turn=0.1, centre_shift=(0.001, 0.002, -0.003))
    alone = MAN.contact_range(POSES[0], load=PUSH, options=options)
    worn = WOMAN.contact_range(RIGHT[:2], options=ep.ContactOptions(cone=None), device=[0.0, 0.0, 9.0, 0.0, 0.0, 0.0])
    return [
        told(each)
        | {
            "variants": {name: one.force for name, one in each.variants.items()},
            "persons": [one.force for one in each.persons[:5]], "count": len(each.persons),
        }
        for each in (alone, worn)
    ]  # fmt: skip


def refused_contact():
    asked, one = ep.ContactOptions, DeviceAction
    zeros, wrench = np.zeros(1), np.ones((1, 6))
    return in_turn(
        power=lambda: asked(4), whole=lambda: asked(2.0), weights=lambda: asked(weights="mass"),
        load=lambda: asked(load_on="hand"), shift=lambda: asked(centre_shift=(0.051, 0, 0)),
        near=lambda: asked(centre_shift=(0.05, 0, -0.05)),
        turn=lambda: asked(socket_turn=1.6), kept=lambda: asked(kept_activation=1.1),
        below=lambda: asked(kept_activation=-0.1), own=lambda: asked(cone=MAN.glenoid_cone()),
        cone=lambda: asked(cone=3),
        pressed=lambda: asked(cone=ep.GlenoidCone(muscle_compression=9.0)), options=lambda: MAN.joint_contact(POSES,
        options=3), limbs=lambda: one(np.zeros(6), np.ones((1, 5)), zeros, zeros), lower=lambda: one(np.zeros(6),
        wrench, np.zeros(2), zeros),
        crossed=lambda: one(np.zeros(6), wrench, zeros + 2.0, zeros), sides=lambda: one(np.zeros(6), wrench, zeros,
        zeros, side_forces=2), least=lambda: one(np.zeros(6), wrench, zeros, zeros, least="force"),
        constant=lambda: one([0, 0, np.nan, 0, 0, 0], wrench, zeros, zeros),
        poses=lambda: MAN.joint_contact(POSES[:2], device=ACTION),
        weak=lambda: replace(MAN, strength=0.0).joint_contact(POSES, device=ACTION),
        outside=lambda: MAN.joint_contact(ep.shoulder_rotation([-110, 150, 40], [44, -62, 30], [73, 106, 10], "left",
        degrees=True), outside="mark").status,
        share=lambda: ep.load("prototype").joint_contact(POSES, MAN, 1.1), gravity=lambda: MAN.joint_contact(POSES,
        gravity=9.81),
    )  # fmt: skip


@in_a_folder
def loads():
    times, cuff, harness = [0.0, 0.13, 0.29], np.arange(18.0).reshape(3, 6) + 0.5, -np.arange(18.0).reshape(3, 6)
    paths = write_external_loads(
        "both.xml", times, cuff, harness, centre_in_torso=(0.01, 0.02, 0.03), humerus="h", torso="t"
    )
    cuff[[1, 2], 3] = np.nan
    paths += write_external_loads("cuff.xml", times, harness)
    return [in_digits(path.read_text()) for path in paths], in_turn(
        ending=lambda: write_external_loads("one.sto", times, cuff), centre=lambda: write_external_loads("one.xml",
        times, harness, harness), lost=lambda: write_external_loads("one.xml", times, cuff),
        shape=lambda: write_external_loads("one.xml", times, cuff[:2]), time=lambda: write_external_loads("one.xml",
        [0, 2, 1], harness),
    )  # fmt: skip


#: Of a compiled model what is compared.
FIELDS = [
    "body_mass",
    "body_inertia",
    "body_ipos",
    "body_pos",
    "body_quat",
    "jnt_stiffness",
    "jnt_range",
    "dof_damping",
    "dof_armature",
    "eq_data",
    "eq_solref",
    "tendon_range",
    "tendon_width",
    "tendon_rgba",
    "site_pos",
    "actuator_ctrlrange",
    "actuator_gear",
    "actuator_trntype",
    "geom_contype",
]


def compiled(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    names = {
        kind: [getattr(model, kind)(k).name for k in range(count)]
        for kind, count in (
            ("body", model.nbody),
            ("joint", model.njnt),
            ("actuator", model.nu),
            ("tendon", model.ntendon),
            ("site", model.nsite),
        )
    }
    return (
        names
        | {name: np.asarray(getattr(model, name), dtype=float) for name in FIELDS}
        | {"counts": [model.neq, model.nsensor, model.nkey]}
        | {
            "without mass": 1e9
            * np.array([model.body_mass[-3:].min(), model.body_inertia[model.body_mass > 0.0].min()])
        }
    )


@in_a_folder
def on_person():
    """A device on a file of a person, in every way."""
    Path("person.xml").write_text(PERSON)
    Path("left.xml").write_text(
        PERSON.replace('"clavicle"', '"clavicle_l"').replace('"humerus"', '"humerus_l"').replace('"ulna"', '"ulna_l"')
    )
    right, found = ep.load("four-cables-worn", side="right"), {}
    soft = ep.load("four-cables", side="right").replace(
        interfaces=ep.Interfaces(cuff=ep.Interface.of([3e3, 2e3, 1e3], [9.0, 8.0, 7.0], at=(0.01, 0.02, -0.15)))
    )
    for name, exo, more in (
        ("weld", right, {}),
        ("spring", soft, {"cuff": "spring", "locked": "wrist"}),
        ("bones", right, {"locked": ("scapula", "elbow"), "bones_only": True}),
        ("three", ep.load("prototype", side="right"), {"locked": "elbow"}),
    ):
        written = exo.export_on_person(f"{name}.xml", "person.xml", **more)
        found[name] = (
            {"lost": written.lost, "worn": written.worn},
            compiled(written[0]),
        )
        Path(written[0]).read_text()[:200].splitlines()[0]
    stiff = ep.Interface(np.diag([3e3] * 3 + [9.0] * 3) + np.eye(6, k=1) + np.eye(6, k=-1))
    export = right.export_on_person
    return found, in_turn(
        ending=lambda: export("one.urdf", "person.xml"), cuff=lambda: export("one.xml", "person.xml", cuff="glue"),
        locked=lambda: export("one.xml", "person.xml", locked="neck"), many=lambda: export("one.xml", "person.xml",
        locked=["elbow", "hip"]),
        spring=lambda: export("one.xml", "person.xml", cuff="spring"),
        coupled=lambda: soft.replace(interfaces=ep.Interfaces(cuff=stiff)).export_on_person("one.xml", "person.xml",
        cuff="spring"), left=lambda: ep.load("four-cables").export_on_person("one.xml", "person.xml"),
        half=lambda: ep.load("four-cables").export_on_person("one.xml", "left.xml"), chain=lambda: ep.load(
            URDF / "spherical-3rrr.urdf").export_on_person("one.xml", "person.xml"), none=lambda: export("one.xml",
        "nothing.xml"), files=lambda: sorted(path.name for path in Path().iterdir()),
    )  # fmt: skip


@in_a_folder
def on_package():
    """A device on MyoArm, both arms."""
    return [
        (written.worn, compiled(written[0]))
        for written in (
            ep.load("four-cables-worn", side=side).export_on_person(f"{side}.xml") for side in ("right", "left")
        )
    ]


ASKED = {
    each.__name__: each
    for each in (
        persons,
        contact,
        worn,
        of_designs,
        words,
        ranges,
        over_assumptions,
        refused_contact,
        loads,
        on_person,
        on_package,
    )
}

#: Those that take longer than 0.15 s.
LONGER = {"over_assumptions", "on_package"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
