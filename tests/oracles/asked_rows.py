"""What is said of robots' files by the tables of ``said_of_files.yaml``, and of URDFs that are wrong somewhere."""

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import mjcf_mutations as wrong
import numpy as np
from asked_chains import tried
from asked_files import brief, in_short, read, said
from caspr_robots import ARM as CABLE_ARM
from caspr_robots import ROUTES, cables, link, motion, system
from mechanisms import five_bar
from mjcf_arm import arm
from said_of_files import ROWS
from sdf_arm import ARM, SHOULDER
from urdf_knee import BARE, GOOD
from urdf_trees import random_tree

import exo_pin as ep
from exo_pin import ClosedChain

#: A closures file, and one of a joint's data.
CLOSURES = """
schema = 1
name = "robot"
[[closures]]
name = "loop"
type = "point"
frame_a = "hand"
frame_b = "universe"
translation_b_mm = [400.0, 0.0, 0.0]
"""
JOINT = 'schema = 1\nname = "r"\n[[joints]]\nname = "j0"\n'
YAML = 'closed_loop: [["tip_a", "tip_b"]]\ntype: ["3d"]\nname_mot: ["left_crank_hinge", "right_crank_hinge"]\n'
INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
#: What changes a URDF somewhere.
CHANGES = (
    *(wrong.set_value, wrong.change_number, wrong.change_number, wrong.remove_attribute, wrong.misspell),
    *(wrong.remove_element, wrong.duplicate, wrong.unname),
)
DATA = (
    *("stiffness_N_m_rad = 2.5", "stiffness_N_m = 2.5", "stiffness_N_mm = 2.5", "stiffness = 2.5"),
    *("armature_kg_m2 = [0.1]", "armature_kg = [1]", "stiffness_N_m_rad = 2\narmature_kg_m2 = [0.2]"),
    *("stiffness_N_m = 2.5\nstiffness_N_mm = 3", 'type = "spherical"', "spring_reference = [0.3]\nstiffness = 1"),
)


def joint(version, kind, inside):
    return (
        f'<robot name="r" version="{version}"><link name="a"/><link name="b"/><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/>{inside}</joint></robot>'
    )


def links(names, joints):
    text = "".join(f'<link name="{name}"/>' for name in names)
    for parent, child in joints:
        text += f'<joint name="{parent}-{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'
    return f'<robot name="r">{text}</robot>'


def two_joints(kind):
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>' if kind in ("revolute", "prismatic") else ""
    return joint("1.0", kind, f'<axis xyz="0 0 1"/>{limit}').replace('"j"', '"j0"')


def of_urdf():
    """Mistakes, synonyms and what is left out of URDFs."""
    given = [GOOD.replace(old, new, 2 if old == "joint" else 1) for old, new, *_ in ROWS["urdf_refused"]]
    given += [GOOD.replace(old, new) for table in ("urdf_same", "urdf_left_out") for old, new, *_ in ROWS[table]]
    for mass, moments, _ in ROWS["urdf_inertias"]:
        values = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), [*moments, "0", "0", "0"], strict=False)
        text = " ".join(f'{key}="{value}"' for key, value in values)
        given.append(GOOD.replace('mass value="2"', f'mass value="{mass}"').replace(INERTIA, f"<inertia {text}/>"))
    for table in ("urdf_joints_read", "urdf_joints_refused"):
        given += [joint(*row[:3]) for row in ROWS[table]]
    given += [links(*row[:2]) for row in ROWS["urdf_trees"]]
    for version, inside, _ in ROWS["urdf_pictures"]:
        body = f'<link name="a"><visual><geometry>{inside}</geometry></visual></link>'
        given.append(f'<robot name="r" version="{version}">{body}</robot>')
    return [read("urdf", text, BARE) for text in given]


def wrong_urdf(seeds):
    """URDFs that are wrong, odd or uncommon in one to three places."""
    found = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 9])
        root = ET.fromstring(GOOD if seed % 3 == 0 else random_tree(seed % 7))
        for _ in range(int(rng.integers(1, 3))):
            CHANGES[rng.integers(len(CHANGES))](rng, root)
        found.append(read("urdf", ET.tostring(root, encoding="unicode"), BARE))
    return found


def of_sdf():
    """Mistakes and what is tolerated in SDFs."""
    given = [ARM.replace(old, new, 1) for table in ("sdf_refused", "sdf_tolerated") for old, new, _ in ROWS[table]]
    ball = ARM.replace('"shoulder" type="revolute"', '"shoulder" type="ball"')
    given += [ball.replace(SHOULDER, f"<axis>{inner}</axis>") for inner, _ in ROWS["sdf_ball"]]
    one = '<sdf version="1.9"><model name="m"><link name="l">{}</link></model></sdf>'
    given += [one.format(f"<pose {how}>{words}</pose>") for how, words, _ in ROWS["sdf_poses"]]
    found = [read("sdf", text) for text in given]
    for inside, named, _ in ROWS["sdf_links"]:
        found.append(read("sdf", one.format(inside)))
        if named is not None:
            found.append(read("sdf", one.format(inside), leave_out=[named]))
    return found


def of_mjcf():
    """What of MJCFs is refused, or left out by name."""
    names = sorted({name for name, *_ in ROWS["mjcf_named"]})
    found = [read("xml", arm(**parts), leave_out=names) for parts, _ in ROWS["mjcf_refused"]]
    found += [read("xml", arm(**parts)) for parts, _ in ROWS["mjcf_left_out"]]
    for name, parts, *_ in ROWS["mjcf_named"]:
        found += [read("xml", arm(**parts)), read("xml", arm(**parts), leave_out=[name])]
    found += [read("xml", text) for text, _ in ROWS["not_mjcf"] if text is not None]
    found += [read("xml", arm(), leave_out="tendons"), read("xml", arm(), leave_out=["tendon"])]
    return [*found, tried(lambda: ClosedChain.from_mjcf(5))]


def in_folder(files, load):
    """What is read in a folder of files."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        found = tried(lambda: load(Path(folder)))
    if isinstance(found[-1], str) and "not YAML" in found[1]:
        return found[:1]
    return said(found)


def of_toml():
    """Closures files, right and wrong, and the data of joints in them."""

    def closures(folder):
        found = ep.chain.read_closures(folder / "r.toml")
        ep.chain.write_closures(found, folder / "again.toml", "Of a test.\n\nTwo lines.")
        return [in_short(found), in_short((folder / "again.toml").read_text(encoding="utf-8"))]

    texts = [CLOSURES, *(CLOSURES.replace(old, new, 1) for old, new, *_ in ROWS["closures_refused"])]
    found = [in_folder({"r.toml": text}, closures) for text in texts]
    rows = [(lines, kind) for lines, kind, _ in ROWS["joints_refused"]]
    rows += [(lines, kind) for lines in DATA for kind in ("revolute", "prismatic", "floating")]
    for lines, kind in rows:
        files = {"r.urdf": two_joints(kind), "r.closures.toml": f"{JOINT}{lines}\n"}
        found.append(in_folder(files, lambda folder: brief(ClosedChain.from_urdf(folder / "r.urdf"))[0][5:]))
    return found


def of_yaml():
    """Folders with a robot.yaml, right and wrong."""
    tips = "".join(
        f'<link name="tip_{letter}"/><joint name="weld_{letter}" type="fixed"><parent link="{side}_forearm"/>'
        f'<child link="tip_{letter}"/><origin xyz="0.275 0 0"/></joint>'
        for letter, side in (("a", "left"), ("b", "right"))
    )
    urdf = five_bar().urdf.replace("</robot>", f"{tips}</robot>")
    texts = [YAML.replace(old, new, 1) for old, new, *_ in ROWS["robot_yaml_refused"]]
    texts += [text.replace("GOOD", YAML) for text, _ in ROWS["yaml_refused"]]
    texts += [YAML, YAML.replace("3d", "6D"), YAML + "name_mot: []", ""]
    kinds = ("SPHERICAL", "FIXED", "CARDAN", "UJOINT_ZX", "UJOINT_XX", "HINGE")
    texts += [f'{YAML}joint_name: ["left_forearm_hinge"]\njoint_type: ["{kind}"]\n' for kind in kinds]
    return [
        in_folder(
            {"robot.urdf": urdf, "robot.yaml": text},
            lambda folder: brief(ClosedChain.from_parallel_robot(folder))[0][:8],
        )
        for text in texts
    ]


def of_caspr():
    """Cable robots, right and wrong."""

    def asked(bodies, routes, *more):
        found = tried(lambda: brief(ClosedChain.from_caspr(bodies, routes, *more)))
        return said(found)

    routes = cables(*ROUTES)
    found = [asked(CABLE_ARM.replace(old, new), routes.replace(old, new)) for old, new, *_ in ROWS["caspr_refused"]]
    found += [asked(CABLE_ARM, routes), asked(CABLE_ARM, routes, "all"), asked(CABLE_ARM, routes, "none")]
    found += [asked(CABLE_ARM, cables(*ROUTES, reference="joint"))]
    counts = {"R_X": 1, "P_X": 1, "P_XZ": 2, "U_YZ": 2, "PLANAR_XZ": 3, "T_XYZ": 3, "S_FIXED_XYZ": 3}
    axis = link(2, "b", motion("R_AXIS", 1, 'axis="0 3 4"'), 1, "0 0 1")
    for kind, count in (counts | {"SPATIAL_EULER_XYZ": 6}).items():
        turned = motion(kind, count).replace('q_initial="0', 'q_initial="0.3', 1)
        found.append(asked(system(link(1, "a", turned, 0, "0 0.1 1"), axis), cables()))
    # Moments about the joint: of a body, and of a rod without thickness, whose own are zero but for rounding.
    for xx, yy, zz, yz in (
        (0.3, 0.25, 0.1, -0.02),
        (0.0519, 0.051, 0.0015, 0.0078),
        (0.05189999, 0.051, 0.0015, 0.0078),
    ):
        about = f"<Ixx>{xx}</Ixx><Iyy>{yy}</Iyy><Izz>{zz}</Izz><Ixy>-0.0006</Ixy><Ixz>0.0039</Ixz><Iyz>{yz}</Iyz>"
        rod = link(1, "rod", motion("R_X", 1), 0, "0 0 0", "joint", about)
        found.append(asked(system(rod), cables(((0, "0 0 0"), (1, "0 0.1 1")), reference="joint")))
    return found
