"""Answers of designs that have drives, springs and brakes beside their limbs, as they are stored."""

import numpy as np
from answers import changes, each_of
from asked_in_turn import folder, in_turn
from places import URDF

import exo_pin as ep

#: What is taken out of a closures file.
LESS = 'arm = "arm"\n', '"abduction", '


def beside():
    """Device files that say more, or what is wrong, beside one robot."""
    text = 'schema = 1\nname = "own"\nrobot = "serial-y-x-z.urdf"\n'
    robots = {
        name: (URDF / name).read_text(encoding="utf-8") for name in ("serial-y-x-z.urdf", "serial-y-x-z.closures.toml")
    }
    joint = ep.load(URDF / "serial-y-x-z.urdf").device.drives[1].joint
    spring, drive = (f'[[{kind}]]\nname = "a"\njoint = "{joint}"\n' for kind in ("springs", "drives"))
    own = f'[[drives]]\nname = "{joint}"\njoint = "{joint}"\n'
    law, at = f"{spring}law = ", '[0, 0, 1]\n[[drives.points]]\nlink = "arm"\npoint_mm = [0, 0, 1]\n'
    cable = f'[[drives]]\nname = "a"\nupper_N = 90\n[[drives.points]]\nlink = "universe"\npoint_m = {at}'

    def by_its_chain(file):
        return ep.ShoulderExo.from_chain(ep.ClosedChain.from_urdf("serial-y-x-z.urdf"), device_file=file)

    def made(more, head="", text=text, less=(), by=ep.load):
        with folder() as place:
            for name, own in robots.items():
                for line in less:
                    own = own.replace(line, "")
                (place / name).write_text(own, encoding="utf-8")
            (place / "serial-y-x-z.device.toml").write_text(f"{text}{head}\n{more}", encoding="utf-8")
            return by("serial-y-x-z.device.toml").device

    def of(more, head="", text=text):
        device = made(more, head, text)
        parts = ("drives", "brakes", "springs", "shoulder", "guided_slides")
        found = [device.name, device.title, device.side, *(str(getattr(device, name)) for name in parts)]
        return [*found, device.interfaces, device.soft_links, device.sources]

    def arm_with(mass=0.0, place=0.0, inertia=0.0):
        """The arm of the robot's file, but for so small a share of its mass, m, and m² times that mass."""
        own = ep.load(URDF / "serial-y-x-z.urdf").arm
        centre = own.centre_of_mass + np.array([0.0, place, 0.0])
        tensor = own.inertia + own.mass * inertia * np.eye(3)
        text = f"[arm]\nmass_kg = {own.mass * (1.0 + mass)!r}\ncentre_of_mass_m = {centre.tolist()}\n"
        return f"{text}inertia_about_centre_kg_m2 = {tensor.tolist()}"

    def drives(more):
        return of(more)[3]

    def springs(more):
        return of(more)[5]

    return in_turn(
        {
            "more": lambda: of("[sources]\narm = 'a book'", 'side = "right"\ntitle = "T"\ncuff_area_cm2 = 120'),
            "constant": lambda: springs(law + '"constant"\neffort_N_m = 2.5\n'),
            "linear": lambda: springs(law + '"linear"\nstiffness_N_m_rad = 2.5\nslack_deg = 30\nonly_pulls = true\n'),
            "table": lambda: springs(law + '"table"\ncoordinates_deg = [-90, 90]\nefforts_N_m = [-1, 2]\n'),
            "gas": lambda: springs(law + '"gas"\nextended_force_N = 2\nextended_length_mm = 300\ngas_height_mm = 90\n'),
            "old": lambda: springs(law + '"constant"\nforce_N = 2.5\n'),
            "old moments": lambda: springs(law + '"table"\ncoordinates_deg = [-90, 90]\nmoments_N_m = [-1, 2]\n'),
            "no law": lambda: springs(law + '"cubic"\n'),
            "no efforts": lambda: springs(law + '"table"\ncoordinates_deg = [-90, 90]\n'),
            "no coordinates": lambda: springs(law + '"table"\nefforts_N_m = [-1, 2]\n'),
            "no force": lambda: springs(cable.replace("drives", "springs").replace("upper_N = 90", 'law = "constant"')),
            "no gas": lambda: springs(law + '"gas"\nextended_length_mm = 300\ngas_height_mm = 90\n'),
            "no height": lambda: springs(law + '"gas"\nextended_force_N = 2\nextended_length_mm = 300\n'),
            "two units": lambda: springs(law + '"linear"\nstiffness_N_m_rad = 2.5\nslack_deg = 30\nslack_m = 0.1\n'),
            "no stiffness": lambda: springs(law + '"linear"\n'),
            "along": lambda: springs(cable.replace("drives", "springs").replace("upper", 'law = "constant"\nforce')),
            "drive": lambda: drives(drive + "lower_N_m = -3\nspeed_deg_s = 90\npower_W = 30\nplay_deg = 0.2\n"),
            "own drive": lambda: drives(own + "upper_N_m = 4\nresolution_deg = 0.2\n"),
            "motor": lambda: drives(drive + "[drives.motor]\ntorque_N_m = 0.3\nspeed_deg_s = 5400\nratio = 40\n"),
            "motor and limit": lambda: drives(drive + "upper_N_m = 3\n[drives.motor]\ntorque_N_m = 0.3\nratio = 40\n"),
            "motor without joint": lambda: drives(cable + "[drives.motor]\ntorque_N_m = 0.3\nratio = 40\n"),
            "cable": lambda: drives(cable),
            "muscle": lambda: drives(cable + '[drives.actuator]\nfamily = "cable"\npull_limit_N = 70\n'),
            "complete": lambda: of(cable, "drives_are_complete = true")[3],
            "brake": lambda: of(f'[[brakes]]\nname = "b"\njoint = "{joint}"\nlimit_N_m = 9\n')[4],
            "unknown key": lambda: of(f'[[brakes]]\nname = "b"\njoint = "{joint}"\nlimits_N = 9\n'),
            "cuff": lambda: of("[cuff]\ntranslational_N_mm = [5, 6, 7]\nrotational_N_m_rad = [1,2,3]\nat_m = [0,0,1]"),
            "arm": lambda: of("[arm]\nmass_kg = 3.3\ncentre_of_mass_m = [0, 0, -0.3]\n"),
            "arm, rounded": lambda: of(arm_with(mass=0.9e-6)),
            "arm, heavier": lambda: of(arm_with(mass=1.1e-6)),
            "arm, elsewhere": lambda: of(arm_with(place=1.1e-6)),
            "arm, rounder": lambda: of(arm_with(inertia=1.1e-7)),
            "arm, nearly as round": lambda: of(arm_with(inertia=0.9e-7)),
            "shoulder": lambda: of("[shoulder]\nstiffness_N_m = [[2e4, 0, 0], [0, 2e4, 0], [0, 0, 1e4]]\n")[6],
            "up": lambda: of("", 'side = "up"'),
            "schema": lambda: of("", text=text.replace("1", "2")),
            "key": lambda: of("", "colour = 1"),
            "roles": lambda: of('[roles]\narm = "arm"\n'),
            "roles, without its own": lambda: [
                [drive.name for drive in made('[roles]\narm = "arm"\n', less=LESS, by=by).drives]
                for by in (ep.load, by_its_chain)
            ],
            "rest": lambda: of(f'[[rest]]\nname = "{joint}"\ncoordinates = [0.1]\n'),
            "rests": lambda: made(f'[[rest]]\nname = "{joint}"\ncoordinates = [0.1]\n').chain.reference_configuration(),
            "no name": lambda: of("", text=text.replace("name", "nome")),
            "no robot": lambda: of("", text=text.replace("y-x-z", "x-y-z")),
        }
    )  # fmt: skip


#: A tendon that is a spring only outside some lengths.
TENDON = """<mujoco><worldbody><site name="a" pos="0.5 0 0"/>
  <body pos="0 0 -1"><joint/><geom size="0.1"/><site name="b"/></body></worldbody>
  <tendon><spatial name="t" stiffness="9" springlength="0.1 0.2"><site site="a"/><site site="b"/></spatial></tendon>
</mujoco>"""


def of_designs():
    """Robots whose device file is that of another design or side, and arms and tendons that files cannot say."""

    def read(*pairs, path=None):
        path = path or ep.load("prototype").to_urdf("one", assumed=None)
        beside = path.with_suffix(".device.toml")
        text = beside.read_text(encoding="utf-8")
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new, 1)
        beside.write_text(text, encoding="utf-8")
        found = ep.load(path)
        return repr(found), found.wrist.beyond_record

    def closed(*pairs):
        """With other words in all files of a wrist."""
        robot = wrist.export("six.urdf")[0]
        for ending in (".urdf", ".closures.toml", ".device.toml"):
            path = robot.with_suffix(ending)
            text = path.read_text(encoding="utf-8")
            for old, new in pairs:
                text = text.replace(old, new)
            path.write_text(text, encoding="utf-8")
        return repr(ep.load(robot))

    def on(side, exo, other=None):
        robot = exo.export("two.urdf")[0]
        chain = (other or ep.load(robot)).chain
        return ep.ShoulderExo.from_chain(chain, side, None, robot.with_suffix(".device.toml")).side

    def without_inertia():
        exo = ep.load(URDF / "six-cables.urdf").replace(arm=ep.Arm(3.0, [0, 0, -0.3]))
        return repr(ep.load(exo.export("three.urdf")[0]).arm)

    wrist, serial = ep.load("prototype"), ep.load(URDF / "serial-y-x-z.urdf")
    with folder():
        return in_turn(
            {
                "as written": read,
                "speed": lambda: read(("[[drives]]", "[[drives]]\nspeed_m_s = 0.2")),
                "place": lambda: read(
                    ("platform_radius_m = 0.", "platform_radius_m = 0.1"), path=wrist.export("four.urdf")[0]
                ),
                "mass": lambda: read(("mass_kg = 0.65", "mass_kg = 0.75"), path=wrist.to_urdf("five")),
                "mass, rounded": lambda: closed(("mass_kg = 0.6565599999999999", "mass_kg = 0.65656045")),
                "mass, nearly": lambda: closed(("mass_kg = 0.6565599999999999", "mass_kg = 0.65656072")),
                "loop, rounded": lambda: closed(("0.11646273", "0.11646353")),
                "loop moved": lambda: closed(("0.11646273", "0.11646383")),
                "loop turned": lambda: closed(
                    ("quaternion_b_xyzw = [0.0, 0.0, 0.0, 1.0]", "quaternion_b_xyzw = [3e-6, 0, 0, 1]")
                ),
                "loop elsewhere": lambda: closed(('frame_b = "universe"', 'frame_b = "arm"')),
                "loop renamed": lambda: closed(
                    ('"limb_1_base"\ntype', '"first"\ntype'), ('closure = "limb_1_base"', 'closure = "first"')
                ),
                "slide renamed": lambda: closed(("limb_1_slide", "first_slide")),
                "side": lambda: on("right", wrist),
                "other design": lambda: on(None, wrist, ep.load("optimised-table-5-3")),
                "side of a robot": lambda: on("left", serial.mirrored()),
                "no inertia": without_inertia,
                "tendon": lambda: ep.ClosedChain.from_mjcf(TENDON),
            }
        )


ASKED = {
    "of_designs": of_designs,
    "beside": beside,
}
LONGER = {"of_designs", "beside"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
