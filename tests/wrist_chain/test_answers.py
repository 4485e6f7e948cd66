"""Answers of wrists as chains: what they are written as, recognised as and hold, as they are stored."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_a_folder, in_digits, in_turn, tried, words_and_numbers
from places import URDF
from scipy.spatial.transform import Rotation
from spatial_mechanisms import delta

import exo_pin as ep
from exo_pin.consistency import check_chain
from exo_pin.wrist_chain import PARTS, AssumedMasses, mechanism_urdf, wrist_of

POINTS = np.array([[0.1, 0.2, 0.05], [-0.12, 0.18, 0.1], [0.03, 0.21, -0.1], [0.2, 0.1, 0.12]])
ENDS = np.array([[0.08, 0.02, -0.2], [-0.05, 0.07, -0.22], [0.01, -0.09, -0.19], [0.06, 0.05, -0.25]])
#: On either side of where angles about z begin anew.
AROUND = np.array([[0.1, 0.0, -0.2], [-0.118, 0.02, -0.21], [-0.077, -0.001, -0.19]])
ARM = ep.Arm(3.7, [0.01, 0.02, -0.3], np.diag([0.12, 0.13, 0.02]))
HALVES = {"base_body": ep.LimbBody.rod(0.3, 0.2, 0.02), "platform_body": ep.LimbBody(0.2, 0.07, 9e-4, 2e-4)}


def wrist(kinds="USUS", turn=(0.1, -0.2, 0.3), halves=None, **more):
    """Limbs between points on torso and arm, universal or spherical at both ends, with halves of mass."""
    geometry = ep.WristGeometry(POINTS[: len(kinds)], ENDS[: len(kinds)], neutral=Rotation.from_rotvec(turn))
    limbs = [ep.Limb({"U": "UPU", "S": "SPS"}[kind], **(HALVES if halves is None else halves)) for kind in kinds]
    return ep.design.Mechanism(geometry, **{"arm": ARM, "limbs": limbs, "name": "own wrist", **more})


def through(kinds, end=-POINTS[3]):
    """The same wrist with a last limb whose line goes through the centre, or to another end."""
    return wrist(kinds).replace(geometry=ep.WristGeometry(POINTS, np.vstack([ENDS[:3], end]), [0, 1, 0.1], [0, 0, 1]))


def written():
    """URDF and closures of wrists, in parts, with and without assumed masses and pictures."""

    def text(mechanism, *given, **more):
        xml, closures = mechanism_urdf(mechanism, *given, **more)
        root = closures.root
        kept = [
            (own.name, own.type, own.frame_a, own.frame_b, own.placement_b.translation, own.placement_b.quaternion)
            for own in closures.closures
        ]
        plain = words_and_numbers(re.sub(r"[\"<>/= ]+", " ", xml.replace("1.7976931348623157e+308", "largest")))
        rows = [plain["numbers"][k : k + 24] for k in range(0, len(plain["numbers"]), 24)]
        return rows, len(plain["words"]), kept, [str(root), str(closures.roles)], plain["words"][:6]

    def far():
        own, away = delta("rigid"), (0.0, 0.0, 3.0)
        apart = [
            replace(each, placement_b=replace(each.placement_b, translation=away)) for each in own.closures.closures
        ]
        found = check_chain(ep.ClosedChain.from_urdf(own.urdf, replace(own.closures, closures=tuple(apart))))
        return [[each.name, each.outcome] for each in found.findings]

    masses = AssumedMasses(base_half_mass=0.1, half_share=0.5, platform_mass=0.7, arm_radius=0.04)
    light = ep.load("prototype").mechanism
    circles = light.replace(arm=None)
    folded = through("USUS")
    across = np.cross(POINTS[3], [1.0, 0.0, 0.0])
    across *= 1e-9 * np.linalg.norm(POINTS[3]) / np.linalg.norm(across)
    # Just within and beyond the sine of a limb that is folded, and the length of one that has none.
    nearly = [
        own + share * across
        for own, share in zip(POINTS[3] * [[-1], [-1], [1], [1]], (0.95, 1.1, 1.9, 2.2), strict=True)
    ]
    # The last one is not known.
    strong = [ep.Actuator("linear", pull_limit=300.0, push_limit=push) for push in (300.0, 200.0, None)]
    drives = [ep.Limb("UPU", actuator=each, **HALVES) for each in strong]
    return in_turn(
        {
            **{part: lambda part=part: text(wrist(), part) for part in PARTS},
            "strong": lambda: re.findall('effort="([^"]*)"', mechanism_urdf(wrist("UUU", limbs=drives))[0]),
            "bare": lambda: text(wrist("UUU"), visuals=False),
            "light": lambda: text(light),
            "assumed": lambda: text(light, "whole", AssumedMasses()),
            "assumed otherwise": lambda: text(wrist("USS", halves={}), "whole", masses, False),
            "no arm": lambda: text(circles, "wrist", masses),
            "no arm in whole": lambda: text(circles),
            "point mass": lambda: text(wrist("UUU", arm=ep.Arm(3.0, [0, 0, -0.3])), "whole", masses, False),
            "point mass alone": lambda: text(wrist("UUU", arm=ep.Arm(3.0, [0, 0, -0.3])), visuals=False),
            "shallow": lambda: text(
                wrist().replace(geometry=ep.WristGeometry(POINTS, ENDS * [1, 1, 0.3], [0, 1, 0.1], [0, 0, 1]))
            ),
            "one half": lambda: text(
                wrist("SSS", halves={"base_body": HALVES["base_body"]}), "floating", masses, False
            ),
            "ring": lambda: text(through("USUS")),
            "open ring": lambda: text(
                wrist("UUU").replace(geometry=ep.WristGeometry(POINTS[:3], AROUND, [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]))
            ),
            "known masses": lambda: vars(AssumedMasses()),
            "strange name": lambda: text(wrist("UUU", name='a "b" <c>'), visuals=False)[4],
            "folded": lambda: text(folded, visuals=False),
            "folded crosses": lambda: text(folded.replace(limbs=[ep.Limb("UPU")] * 4), visuals=False),
            "no length": lambda: text(
                wrist().replace(geometry=ep.WristGeometry(POINTS, np.r_[ENDS[:3], POINTS[3:]], [0, 1, 0.1], [0, 0, 1]))
            ),
            "nearly": lambda: tried(lambda k: text(through("USUU", nearly[k]), visuals=False)[1], *range(4)),
            "far": far,
            "folded spheres": lambda: text(folded.replace(limbs=[ep.Limb("SPS")] * 4), visuals=False),
            "no part": lambda: mechanism_urdf(wrist(), "arm"),
            "no wrist": lambda: mechanism_urdf(3),
            "statement": lambda: masses.statement,
            "halves": lambda: (masses.base_half(0.4), masses.platform_half(0.4), AssumedMasses().base_half(0.3)),
            "bodies": lambda: (masses.cross_body(), masses.platform(ENDS), masses.platform(ENDS[:3] * [1, 1, 0.5])),
        }
    )


@in_a_folder
def files():
    """What files of each part there are, what their heads say, and names that no file can have."""
    own = ep.ShoulderExo.from_mechanism(wrist("USU"))
    heads = [own.to_urdf("robot", part).with_suffix(".closures.toml").read_text().splitlines()[:3] for part in PARTS]
    names = ("a/b", "-a", "")
    return (
        heads,
        sorted(path.name for path in Path("robot").iterdir()),
        tried(lambda name: ep.ShoulderExo.from_mechanism(wrist("UUU", name=name)).to_urdf("robot").name, *names),
    )


def recognised():
    """What chains are recognised as, and why others are none."""

    def of(chain, *side):
        found = wrist_of(chain, *side)
        own = found.mechanism
        limbs = [in_digits(str(limb)) for limb in own.limbs]
        points = own.geometry.base_points, own.geometry.platform_points, own.geometry.neutral
        return [own.name, own.side, own.gravity, own.arm and own.arm.centre_of_mass, limbs, points, found.beyond_record]

    def chain(mechanism, *part):
        return ep.ClosedChain.from_urdf(*mechanism_urdf(mechanism, *part))

    def edited(*pairs, closures=lambda own: own, mechanism=None):
        xml, own = mechanism_urdf(wrist("USU") if mechanism is None else mechanism, visuals=False)
        for was, now in pairs:
            assert re.search(was, xml), was
            xml = re.sub(was, now, xml, count=1)
        return of(ep.ClosedChain.from_urdf(xml, closures(own)))

    def roles(**more):
        return lambda own: replace(own, roles=replace(own.roles, **more))

    def moved(own, by=1e-3):
        first, *others = own.closures
        place = replace(first.placement_b, translation=tuple(np.add(first.placement_b.translation, (0, 0, by))))
        return replace(own, closures=(replace(first, placement_b=place), *others))

    def first(**other):
        return lambda own: replace(own, closures=(replace(own.closures[0], **other), *own.closures[1:]))

    def turned(found):
        return found[1] + " ".join(f"{-float(number)!r}" for number in found[2].split())

    level = wrist("USU").replace(geometry=ep.WristGeometry(POINTS[:3], [[0.1, 0.02, -0.2], *ENDS[1:3]]))
    joint = r'(<joint name="limb_1_platform_x"[\s\S]*?<origin xyz=")'
    rub = r'(<joint name="limb_2_slide"[\s\S]*?)</joint>'
    return in_turn(
        {
            "whole": lambda: of(chain(wrist())),
            "floating": lambda: of(chain(wrist("USSU"), "floating")),
            "alone": lambda: of(chain(wrist("UUU", arm=None), "wrist"), "right"),
            "turned": lambda: of(chain(wrist("SSS", gravity=[0.3, 0.0, -9.7]))),
            "assumed": lambda: of(
                ep.ClosedChain.from_urdf(*mechanism_urdf(wrist("UUU", halves={}), "whole", AssumedMasses()))
            ),
            "as it is": lambda: edited(),
            "no arm": lambda: edited(closures=roles(arm=None)),
            "two limbs": lambda: edited(
                closures=lambda own: replace(own, roles=replace(own.roles, limbs=own.roles.limbs[:2]))
            ),
            "elsewhere": lambda: edited((joint + r"\S+", r"\g<1>0.3")),
            "other axis": lambda: edited((r'(limb_1_slide[\s\S]*?axis xyz=")\S+', r"\g<1>0.9")),
            # The first limb's slide goes across x; it may not go the other way.
            "backwards": lambda: edited((r'(limb_1_slide" type[\s\S]*?axis xyz=")([^"]*)', turned), mechanism=level),
            "light crosses": lambda: [
                of(ep.ClosedChain.from_urdf(*mechanism_urdf(wrist("UUU", arm=arm), "wrist", masses)))[-1]
                for arm, mass in ((ARM, 3.7e-9), (None, 1e-9))
                for masses in (AssumedMasses(cross_mass=share * mass, platform_mass=0.0) for share in (0.95, 1.1))
            ],
            "damped": lambda: edited((rub, r'\1<dynamics damping="0.3" friction="0.1"/></joint>')),
            "heavier": lambda: edited((r'(<link name="limb_2_platform_body"[\s\S]*?mass value=")[^"]*"', r'\g<1>0.4"')),
            "at the joints": lambda: of(chain(wrist("USU", halves={"base_body": ep.LimbBody(0.3, 0.0, 4e-4, 4e-4)}))),
            "moved": lambda: edited(closures=moved),
            "moved less": lambda: edited(closures=lambda own: moved(own, 2.25e-10)),
            "moved a little": lambda: edited(closures=lambda own: moved(own, 2.6e-10)),
            "mirrored": lambda: of(chain(wrist("USU")).mirrored(), "right"),
            "other closure": lambda: edited(closures=first(type="spherical")),
            "other end": lambda: edited(closures=first(placement_a=ep.chain.Placement((0.0, 0.0, 1e-6)))),
            "other link": lambda: edited(closures=first(frame_a="limb_1_base_cross")),
            "other order": lambda: edited(closures=lambda own: replace(own, closures=own.closures[::-1])),
            "other kind": lambda: edited(
                closures=lambda own: replace(
                    own, roles=replace(own.roles, limbs=tuple(replace(limb, kind="SPS") for limb in own.roles.limbs))
                )
            ),
            "hinges": lambda: of(ep.load(URDF / "nesm.urdf").chain),
            "no chain": lambda: wrist_of(3),
        }
    )


def balanced():
    """Forces of wrists with limbs of mass, universal and spherical, at rest, moving, loaded and displaced."""
    load = ep.Load([2.0, -1.0, -6.0], [0.1, 0.0, -0.2], [0.0, 0.01, -0.3])
    motion = ep.Motion([0.3, -0.9, 0.2], [1.0, -2.0, 0.5])

    def asked(mechanism, **case):
        exo = ep.ShoulderExo.from_mechanism(mechanism)
        poses = exo.pose([12.0, 40.0], [[8.0], [25.0]], 5.0)
        found = exo.reaction(poses, limits="none", **case)
        return [found.status, found.shoulder_force, found.actuator_forces, found.cuff_wrench, found.harness_wrenches]

    return in_turn(
        {
            "mixed": lambda: asked(wrist()),
            "moving": lambda: asked(wrist(), motion=motion, load=load),
            "turning": lambda: asked(wrist(), motion=ep.Motion([0.3, -0.9, 0.2], np.zeros(3))),
            "starting": lambda: asked(wrist(), motion=ep.Motion(np.zeros(3), [1.0, -2.0, 0.5])),
            "through the centre": lambda: asked(through("USUS"), motion=motion),
            "universal": lambda: asked(wrist("UUU"), motion=motion),
            "spherical": lambda: asked(wrist("SSS"), motion=motion),
            "four spherical": lambda: asked(wrist("SSSS", gravity=[1.0, 0.5, -9.6]), load=load),
            "displaced": lambda: asked(wrist("USU"), centre_offset=[0.004, -0.003, 0.006], load=load),
            "least": lambda: asked(wrist("UUU"), split="minimal", constraint_bounds=15.0),
            "alone": lambda: asked(wrist(), split="standalone", motion=motion),
            "half a limb": lambda: asked(
                wrist("USU", halves={"platform_body": HALVES["platform_body"]}), motion=motion
            ),
            "of no inertia": lambda: asked(wrist("UUU", arm=ep.Arm(3.0, [0, 0, -0.3]))),
            "no inertia, moving": lambda: asked(wrist("UUU", arm=ep.Arm(3.0, [0, 0, -0.3])), motion=motion),
            "no arm": lambda: asked(wrist("UUU", arm=None)),
        }
    )


ASKED = {"written": written, "files": files, "recognised": recognised, "balanced": balanced}

#: Those that take longer than 0.15 s.
LONGER = {"written", "files", "recognised", "balanced"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
