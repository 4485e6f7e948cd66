"""Answers of the one object at its doors, and of the command line about one pose, as they are stored."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import folder, in_turn, printed, words_and_numbers
from places import URDF

import exo_pin as ep
from exo_pin.exo.pose_report import PoseReport


def pose(design, flexion=0.0, abduction=0.0, inward=0.0, *more):
    design = URDF / f"{design}.urdf" if (URDF / f"{design}.urdf").exists() else design
    angles = ("--flexion", flexion, "--abduction", abduction, "--internal-rotation", inward)
    return printed("reaction", design, *angles, *more)


def one_pose():
    """The first answer and all that is known, of designs that hold, cannot hold, are not known to, or only support."""
    cases = {
        "held": ("four-linear-actuators-worn", 60, 30),
        "explained": ("four-linear-actuators-worn", 60, 30, 5, "--explain"),
        "not held": ("prototype", 110, 40, 0),
        "why not": ("prototype", 110, 40, 0, "--explain"),
        "cables": ("four-cables", 70, 15, 0, "--hand-force", "3,-2,-25", "--explain"),
        "pulling": ("four-cables", 70, 15, 0, "--limits", "pull"),
        "between": ("four-cables", 70, 15, 0, "--limits", "5,60"),
        "no limits": ("four-linear-actuators-worn", 60, 30, 0, "--limits", "none"),
        "displaced": ("four-linear-actuators-worn", 60, 30, 0, "--offset", 4, -6, 3, "--explain"),
        "right": ("four-cables", 30, 60, -10, "--side", "right"),
        "hinges explained": ("serial-y-x-z", 60, 20, 5, "--explain"),
        "unlimited": ("nesm", 60, 20, 5, "--explain"),
        "too high": ("spring-support", 170),
        "springs": ("spring-support", 20, 10),
        "six": ("six-cables", 45, 35, 5),
        "hanging": ("six-cables",),
        "free limbs": ("3rps-passive-ball", 3, 5, 2, "--explain"),
        "too far": ("3rps-passive-ball", 50),
        "singular": ("serial-y-x-z", 0, 90),
        "hardly turned": ("four-cables", 0.055, -0.049, 0.061),
        "beside a twin": ("prototype", 30, 20),
        "nearly singular": ("serial-y-x-z", 0, 89.97),
        "nearly singular explained": ("serial-y-x-z", 0, 89.97, 0, "--explain"),
        "row": ("four-cables", 20, 10, 0, "--to", "70,40,10", "--poses", 3),
    }  # fmt: skip
    forces = {name: ("forces", URDF / f"{name}.urdf") for name in ("serial-y-x-z", "spring-support")}
    return {name: pose(*case) for name, case in cases.items()} | {
        f"{name} by its chain": printed(*words, "--flexion", 60, "--external", "arm=0,0,-20")
        for name, words in forces.items()
    }


def asked():
    """Questions as JSON lines, whole and wrong."""
    text = (URDF / "spring-support.urdf").read_text(encoding="utf-8")
    closures = (URDF / "spring-support.closures.toml").read_text(encoding="utf-8")
    with folder() as place:
        ep.load("prototype").save("own.toml")
        design = (place / "own.toml").read_text(encoding="utf-8")
    wearer = {"height": 1.7, "mass": 70, "sex": "female"}
    at = {"flexion": 60, "abduction": 20}
    quaternion = ep.shoulder_rotation(40, 20, 10, degrees=True).as_quat().tolist()
    load = {"force": [0, 0, -10], "at": [0, 0, -0.5]}
    motion = {"angular_velocity": [0, 1, 0], "angular_acceleration": [1, 0, 0]}
    lines = [
        {
            "question": "reaction",
            "poses": at,
            "load": load,
            "motion": motion,
            "worn_by": wearer,
            "side": "right",
            "id": 5,
        },
        {"question": "reaction", "poses": {"quaternions_xyzw": quaternion}, "limits": "none", "split": "minimal"},
        {"question": "reaction", "poses": at, "centre_offset": [0, 0.002, 0.01]},
        {"question": "reaction", "poses": at, "split": "minimal", "weights": {"tension": 0.1}},
        {"question": "reaction", "poses": at, "cone": {"superior": 0.5}},
        {"question": "reaction", "poses": at, "centre_offset": {"together": [0, 0, 0.01]}},
        {"question": "reaction", "poses": at, "design": {"urdf": text, "closures": closures}},
        {"question": "singularity", "poses": {"flexion": [60, 30], "abduction": 20}},
        {"question": "inverse_kinematics", "poses": at, "design": "prototype"},
        {"question": "accuracy", "poses": at},
        {"question": "workspace", "poses": {"flexion": [60, 30], "abduction": 20}, "criteria": ["forces", "stroke"]},
        {"question": "compare", "poses": at},
        {"question": "force", "poses": at},
        {"question": "reaction", "pose": at},
        {"question": "reaction"},
        {"question": "reaction", "poses": 3},
        {"question": "reaction", "poses": {"flexion": 3, "flex": 4}},
        {"question": "reaction", "poses": {"quaternions_xyzw": [0, 0, 0, 2]}},
        {"question": "reaction", "poses": at, "load": {"force": [0, 0]}},
        {"question": "reaction", "poses": at, "load": {"forces": [0, 0, 1]}},
        {"question": "reaction", "poses": at, "limits": "strong"},
        {"question": "reaction", "poses": at, "side": "up"},
        {"question": "reaction", "poses": at, "design": "none"},
        {"question": "reaction", "poses": at, "design": {"toml": "schema = 1"}},
        *(
            {"question": "reaction", "poses": at, "limits": "none", "design": {"toml": design}, "side": side}
            for side in (None, "left", "right")
        ),
        {"question": "reaction", "poses": at, "design": {"xml": "a"}},
        {"question": "reaction", "poses": at, "worn_by": {"height": 17, "mass": 70, "sex": "female"}},
        {"question": "reaction", "poses": at, "schema": "exo_pin.sweep/1"},
        {"question": 3},
        [3],
        3,
    ]
    wrong = ["", '{"question": NaN}', '{"question": "check", "question": "check"}']
    with folder() as place:
        (place / "asked.jsonl").write_text("\n".join([*map(json.dumps, lines), *wrong]) + "\n", encoding="utf-8")
        return [short(line) for line in printed("batch", "asked.jsonl")]


def short(line):
    """An answered line, without what stands in the answer beside its numbers."""
    found = json.loads(line)
    own, error = found["answer"], found["error"]
    kept = ("verdict", "shoulder_force", "actuator_forces", "can_hold", "kind", "positions", "index", "rate")
    told = error and f"{error['kind']}: {error['message']}"
    told = told or {"device": own["device"]["name"]} | {key: own[key] for key in kept if key in own}
    return [found["line"], found["id"], found["question"], told, found["warnings"]]


def files():
    """Designs and robots that are loaded, written and not loaded."""
    wrist = ep.load("four-cables")
    bare = ep.ShoulderExo.from_chain(ep.load("prototype").chain)

    def exported(exo, name, part="whole"):
        found = exo.export(name, part)
        return [file.name for file in found], found.beside, found.lost, found.statement

    def texts(exo, **more):
        path = exo.to_urdf("written", **more)
        return {file.name: len(file.read_text().splitlines()) for file in sorted(path.parent.iterdir())}, repr(
            ep.load(path)
        )

    def designs(text, table="table.csv"):
        Path(table).parent.mkdir(exist_ok=True)
        Path(table).write_text(text, encoding="utf-8")
        return [(exo.name, exo.side, exo.device.dimensions()["A[1].radius_m"]) for exo in ep.load_designs(table)]

    def of_a_side(side):
        """A robot without an arm whose file beside it states its side alone."""
        for name in ("dummy-shoulder.urdf", "dummy-shoulder.closures.toml"):
            (place / name).write_text((URDF / name).read_text(encoding="utf-8"), encoding="utf-8")
        text = f'schema = 1\nname = "own"\nrobot = "dummy-shoulder.urdf"\nside = "{side}"\n'
        (place / "dummy-shoulder.device.toml").write_text(text, encoding="utf-8")
        return ep.load("dummy-shoulder.urdf")

    def saved(exo, name="own.toml"):
        exo.save(name)
        return words_and_numbers((place / name).read_text(encoding="utf-8")), repr(ep.load(name))

    turned = replace(wrist.mechanism, gravity=np.array([0.5, 0.0, -9.7]))
    with folder() as place:
        return in_turn(
            {
                "urdf": lambda: exported(wrist, "a.urdf"),
                "mjcf": lambda: exported(wrist, "a.xml"),
                "sdf": lambda: exported(wrist, "a.sdf"),
                "wrist": lambda: exported(wrist, "w.urdf", "wrist"),
                "wrist as mjcf": lambda: exported(wrist, "w.xml", "wrist"),
                "part": lambda: exported(wrist, "w.xml", "arm"),
                "no format": lambda: exported(wrist, "w.stl"),
                "hinges": lambda: exported(ep.load(URDF / "serial-y-x-z.urdf"), "s.xml"),
                "part of hinges": lambda: exported(ep.load(URDF / "serial-y-x-z.urdf"), "s.xml", "wrist"),
                "written": lambda: texts(wrist),
                "of the right": lambda: texts(wrist.mirrored()),
                "wrist alone": lambda: texts(wrist, part="wrist"),
                "written hinges": lambda: texts(ep.load(URDF / "serial-y-x-z.urdf").mirrored()),
                "saved": lambda: saved(wrist),
                "saved turned": lambda: saved(ep.ShoulderExo.from_mechanism(turned), "turned.toml"),
                "again": lambda: saved(ep.load(URDF / "serial-y-x-z.urdf"), "serial.toml")[1],
                "once more": lambda: ep.load("serial.toml").save("serial.toml"),
                "in the way": lambda: saved(ep.load(URDF / "nesm.urdf"), "a.toml"),
                "over a design": lambda: saved(ep.load(URDF / "nesm.urdf"), "own.toml")[1],
                "effort limits": lambda: [
                    str(own.tolist())
                    for model in [wrist.chain_with_masses().model]
                    for own in (model.lowerEffortLimit, model.upperEffortLimit)
                ],
                "table": lambda: designs(
                    "design,name,A[1].radius_mm,lean_left_deg\nfour-cables,one,251,\nfour-cables,,240,0.5\nfour-cables,,,\n"
                ),
                "table beside a design": lambda: (
                    wrist.save("own.toml"),
                    designs("design,lean_left_deg\n../own.toml,3\nfour-cables,2\n", "tables/table.csv"),
                )[1],
                "table of nothing": lambda: designs("design,name\n"),
                "table of no design": lambda: designs("name,A[1].radius_mm\na,3\n"),
                "wrong value": lambda: designs("design,A[1].radius_mm\nfour-cables,2:3:2\n"),
                "wrong column": lambda: designs("design,radius_mm\nfour-cables,2\n"),
                "wrong design": lambda: designs("design,name\nfive-cables,2\n"),
                "no name": lambda: ep.load("five-cables"),
                "number": lambda: ep.load(5),
                "no file": lambda: ep.load("none.toml"),
                "no robot": lambda: ep.load("none.urdf"),
                "left": lambda: ep.load("four-cables", side="up"),
                "right": lambda: [
                    repr(ep.load("prototype", side="right")),
                    repr(ep.load(URDF / "nesm.urdf", side="right")),
                ],
                "as a wrist": lambda: (repr(bare), bare.wrist is not None, bare.has_arm),
                "side without an arm": lambda: [of_a_side(side).side for side in ("left", "right")],
            }
        )


def parts():
    """What each kind of design has, and what it says of what it has not."""

    def of(exo):
        names = (
            "name",
            "side",
            "has_arm",
            "limbs",
            "geometry",
            "mechanism",
            "forward_kinematics",
            "nearest_singularity",
        )
        return {name: of_attribute(exo, name) for name in names} | {
            "shown": repr(exo), "mirrored": repr(exo.mirrored()), "own": [name for name in dir(exo) if name[0] != "_"],
        }  # fmt: skip

    def of_attribute(exo, name):
        try:
            found = getattr(exo, name)
        except (AttributeError, ep.ExoPinError) as error:
            return f"{type(error).__name__}: {error}"
        return found if isinstance(found, str | bool) else type(found).__name__

    def robot():
        chain = ep.load("prototype").chain
        roles = replace(chain.roles, arm=None, limbs=())
        return ep.ShoulderExo.from_chain(ep.ClosedChain(chain.model, replace(chain.description, roles=roles)))

    wrist = ep.load("four-linear-actuators")
    points = wrist.pose([20, 60], [[10], [30]], 5)
    return in_turn(
        {
            "wrist": lambda: of(wrist),
            "hinges": lambda: of(ep.load(URDF / "serial-y-x-z.urdf")),
            "no arm": lambda: of(robot()),
            "moved": lambda: [
                type(exo.moved_record).__name__
                for exo in (wrist, ep.ShoulderExo.from_chain(wrist.chain_with_masses()), ep.load(URDF / "nesm.urdf"))
            ],
            "pose": lambda: PoseReport(wrist.reaction(wrist.pose(60, -10, 5)), None, None).pose_in_words,
            "no device": lambda: robot().device,
            "no forces": lambda: robot().reaction(wrist.pose(3)),
            "forward": lambda: wrist.forward_kinematics(wrist.inverse_kinematics(wrist.pose(20, 10, 5)).lengths),
            "from angles": lambda: wrist.forward_kinematics_from_base_angles([[0.1, 0.2]] * 3),
            "near": lambda: ep.load("prototype").nearest_singularity(points[1]),
            "limb state": lambda: wrist.inverse_kinematics(points[1]),
            "jacobian": lambda: wrist.jacobian(wrist.pose(20, 10, 5)),
            "field": lambda: wrist.replace(colour=3),
            "nobody": lambda: wrist.worn_by(3),
            "worn": lambda: repr(wrist.worn_by(ep.Wearer(1.7, 60, "female"))),
            "labels": lambda: wrist.view(labels=True),
            "limbs alone": lambda: ep.load(URDF / "six-cables.urdf").wrist.limbs_alone().limb_count,
            "looks": lambda: robot().view(human=True),
            "configuration": lambda: wrist.view(q=wrist.configurations(wrist.pose(20)), human=False),
            "remedy": lambda: str(ep.load("prototype").remedy(wrist.pose(110, 40))),
            "map": lambda: np.nanmax(wrist.reaction_map(points).magnitude),
            "compare": lambda: str(wrist.compare(ep.load("four-cables"), poses=points)),
            "modes": lambda: ep.load(URDF / "serial-y-x-z.urdf").assembly_modes(wrist.pose(20, 10), starts=4).shape,
        }
    )  # fmt: skip


ASKED = {"one_pose": one_pose, "asked": asked, "files": files, "parts": parts}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
