"""MJCF that is wrong, odd or uncommon in one to three places."""

import xml.etree.ElementTree as ET

import numpy as np
from mjcf_chains import random_robot

#: A robot with more kinds of elements than a random one.
PLANT = """<mujoco model="plant"><compiler angle="degree" autolimits="true"/>
<option gravity="0.3 0.1 -9.81" timestep="0.002" integrator="implicit"><flag contact="enable"/></option>
<default><joint damping="0.3" armature="0.02"/><default class="stiff"><joint stiffness="7" springref="10"/></default>
</default>
<worldbody><geom type="plane" size="1 1 0.1"/><site name="ground" pos="0.4 0 0.2"/>
<body name="base" pos="0 0 0.5"><joint name="lift" type="slide" axis="0 0 1" range="-0.3 0.3"/>
  <geom type="box" size="0.1 0.2 0.05" mass="2"/><site name="top" pos="0 0 0.05" euler="10 0 20"/>
  <body name="upper" pos="0.1 0 0" euler="0 20 0"><joint name="swing" axis="0 1 0" pos="0 0 0.05" ref="15"/>
    <joint name="twist" axis="1 0 0" class="stiff"/><geom type="capsule" size="0.03 0.1" pos="0.1 0 0"/>
    <body name="fore" pos="0.25 0 0"><joint name="elbow" axis="0 1 0" range="-120 120" actuatorfrcrange="-30 20"/>
      <inertial pos="0.1 0 0.02" mass="0.7" fullinertia="0.01 0.02 0.025 0.001 0 0.002"/>
      <site name="tip" pos="0.2 0 0"/>
      <body name="tool" pos="0.2 0 0"><geom size="0.03"/></body></body></body>
  <body name="other" pos="-0.2 0.1 0"><joint name="ball" type="ball"/><geom type="box" size="0.1 0.05 0.02"/>
    <body name="end" pos="0 0.2 0"><joint name="turn" axis="1 1 0"/><geom type="cylinder" size="0.04 0.05"/></body>
  </body>
</body><body name="loose" pos="0 0 2"><freejoint name="fly"/>
  <geom type="ellipsoid" size="0.1 0.05 0.07"/></body></worldbody>
<equality><connect name="tie" body1="fore" body2="end" anchor="0.1 0 0"/>
  <weld name="glue" body1="loose" body2="base" anchor="0.1 0 0" torquescale="2"/></equality>
<tendon><spatial name="measure"><site site="tip"/><site site="ground"/></spatial></tendon>
<actuator><motor name="drive" joint="elbow" gear="5" ctrlrange="-2 3" armature="0.01" damping="0.02"/>
  <general joint="swing" gainprm="3" forcerange="-4 4" group="2"/></actuator>
<sensor><jointpos joint="elbow"/></sensor>
<keyframe><key name="bent" qpos="0.1 0.2 0.3 -0.2 1 0 0 0 0.4 0 0 1 1 0 0 0"/></keyframe></mujoco>"""

#: Values that a careless hand, or a script, writes.
VALUES = (
    *("nan", "inf", "-inf", "-1", "0", "1", "2.5", "-0.3", "1e300", "-1e300", "1e-300", "1e9", "1e-9", "", " ", "abc"),
    *("0 0 0", "1 2 3", "0.3 0 -0.4", "nan 0 0", "1e200 0 0", "0 0 0 0", "1 0 0 0", "3 4 0 0", "1 2", "1 2 3 4 5 6 7"),
    *("true", "false", "auto", "enable", "disable", "world", "universe", "base", "fore", "elbow", "tip", "body0"),
    *("hinge", "slide", "ball", "free", "joint0_0", "1 0 0 0.6 0.8 0 0", "-1 1", "1 -1", "é", "a b", "999999999999"),
)
#: Attributes that elements can have and ours do not.
ADDED = {
    "option": (("density", "1.2"), ("viscosity", "0.1"), ("wind", "1 0 0"), ("actuatorgroupdisable", "2")),
    "flag": (
        *(("gravity", "disable"), ("spring", "disable"), ("damper", "disable"), ("frictionloss", "disable")),
        *(("limit", "disable"), ("constraint", "disable"), ("equality", "disable"), ("actuation", "disable")),
        *(("clampctrl", "disable"), ("eulerdamp", "disable"), ("sleep", "enable"), ("energy", "enable")),
    ),
    "body": (("gravcomp", "1"), ("mocap", "true"), ("name", "universe"), ("sleep", "allowed"), ("childclass", "stiff")),
    "joint": (
        *(("stiffness", "3 1 2"), ("damping", "1 0.5 0.2"), ("frictionloss", "0.4"), ("springdamper", "0.5 1")),
        *(
            ("margin", "0.1"),
            ("limited", "true"),
            ("range", "-10 20"),
            ("actuatorfrclimited", "true"),
            ("armature", "1"),
        ),
        *(
            ("ref", "30"),
            ("springref", "-20"),
            ("actuatorgravcomp", "true"),
            ("name", "universe"),
            ("springyield", "1"),
        ),
    ),
    "geom": (("mass", "3"), ("density", "10"), ("fluidshape", "ellipsoid"), ("adhesion", "1"), ("gap", "0.1")),
    "connect": (("active", "false"), ("solref", "0.1 1"), ("anchor", "0.3 0 0")),
    "weld": (("active", "false"), ("torquescale", "0"), ("torquescale", "-2"), ("anchor", "0.3 0 0")),
    "motor": (("forcerange", "-1 4"), ("gear", "0"), ("gear", "-3 1 0"), ("group", "1"), ("ctrllimited", "false")),
    "general": (("biastype", "affine"), ("biasprm", "1 2 3"), ("dyntype", "muscle"), ("gear", "2 3")),
    "spatial": (("stiffness", "3"), ("limited", "true"), ("range", "0 1"), ("armature", "0.3"), ("damping", "2")),
    "compiler": (("angle", "radian"), ("coordinate", "global"), ("balanceinertia", "true"), ("boundmass", "5")),
}
#: Elements that ours do not have, by the element that they go into.
INSERTED = {
    "equality": (
        '<joint joint1="elbow" joint2="twist"/>',
        '<tendon tendon1="measure"/>',
        '<weld site1="tip" site2="top"/>',
    ),
    "actuator": (
        *('<position joint="elbow" kp="3"/>', '<velocity joint="twist" kv="2"/>', '<motor joint="ball" gear="1 2 3"/>'),
        *('<muscle joint="elbow" ctrllimited="false"/>', '<motor site="tip"/>', '<motor tendon="measure"/>'),
        *(
            '<motor jointinparent="elbow"/>',
            '<damper joint="elbow" kv="3" ctrlrange="0 1"/>',
            '<adhesion body="fore"/>',
        ),
        *('<intvelocity joint="elbow" kp="2" actrange="-1 1"/>', '<cylinder joint="lift" timeconst="0.2"/>'),
    ),
    "tendon": (
        '<fixed name="sum"><joint joint="elbow" coef="2"/></fixed>',
        '<fixed stiffness="2"><joint joint="turn" coef="1"/></fixed>',
    ),
    "body": (
        *(
            '<joint type="slide" axis="0 1 0" stiffness="4"/>',
            '<joint axis="0 0 1" ref="20" damping="2"/>',
            "<freejoint/>",
        ),
        *(
            '<body pos="0 0 0.1"><joint/><geom size="0.05"/></body>',
            '<geom size="0.1" mass="0.5"/>',
            '<site name="base"/>',
        ),
        *(
            '<inertial pos="0 0.1 0" mass="2" diaginertia="0.1 0.2 0.25"/>',
            '<body name="fixed"><geom size="0.02"/></body>',
        ),
    ),
    "worldbody": (
        '<body name="second"><joint name="second" pos="0 0 1"/><geom size="0.1" pos="0.2 0 0"/></body>',
        '<body name="mover" mocap="true"/>',
    ),
    "mujoco": ('<option gravity="1 2 3"/>', '<size memory="2M"/>', '<custom><numeric name="n" data="1"/></custom>'),
}


def mutated(seed):
    """A mutated text; the same for the same seed."""
    rng = np.random.default_rng([seed, 4])
    text = PLANT if rng.random() < 0.7 else random_robot(int(rng.integers(100))).text
    root = ET.fromstring(text)
    for _ in range(rng.integers(1, 4)):
        MUTATIONS[rng.integers(len(MUTATIONS))](rng, root)
    text = ET.tostring(root, encoding="unicode")
    if rng.random() < 0.03:
        at = int(rng.integers(len(text)))
        text = text[:at] + ("" if rng.random() < 0.5 else text[at + 1 :])
    return text


def _some(rng, elements):
    elements = list(elements)
    return elements[rng.integers(len(elements))] if elements else None


def _with_attributes(root):
    return [element for element in root.iter() if element.attrib]


def _parents(root):
    return [(parent, child) for parent in root.iter() for child in parent]


def set_value(rng, root):
    element = _some(rng, _with_attributes(root))
    element.set(_some(rng, element.attrib), _some(rng, VALUES))


def change_number(rng, root):
    """Another number of the same kind: mostly a valid file."""
    numeric = []
    for element in _with_attributes(root):
        for key, value in element.attrib.items():
            try:
                numeric.append((element, key, [float(part) for part in value.split() or ["none"]]))
            except ValueError:
                continue
    element, key, values = numeric[rng.integers(len(numeric))]
    at = rng.integers(len(values))
    values[at] = float(values[at] * rng.normal() + rng.normal() * rng.choice([0.0, 0.1, 1.0]))
    element.set(key, " ".join(repr(value) for value in values))


def remove_attribute(rng, root):
    element = _some(rng, _with_attributes(root))
    del element.attrib[_some(rng, element.attrib)]


def misspell(rng, root):
    element = _some(rng, _with_attributes(root))
    key = _some(rng, element.attrib)
    element.set(key[:-1] + "x", element.attrib.pop(key))


def remove_element(rng, root):
    parent, child = _parents(root)[rng.integers(len(_parents(root)))]
    parent.remove(child)


def duplicate(rng, root):
    parent, child = _parents(root)[rng.integers(len(_parents(root)))]
    parent.append(child)


def unname(rng, root):
    named = [element for element in root.iter() if "name" in element.attrib]
    if named:
        del _some(rng, named).attrib["name"]


def add_attribute(rng, root):
    element = _some(rng, [element for element in root.iter() if element.tag in ADDED])
    element.set(*ADDED[element.tag][rng.integers(len(ADDED[element.tag]))])


def add_flag(rng, root):
    option = root.find("option")
    if option is None:
        option = ET.SubElement(root, "option")
    flag = option.find("flag")
    if flag is None:
        flag = ET.SubElement(option, "flag")
    flag.set(*ADDED["flag"][rng.integers(len(ADDED["flag"]))])


def insert(rng, root):
    element = _some(rng, [element for element in root.iter() if element.tag in INSERTED])
    element.insert(int(rng.integers(len(element) + 1)), ET.fromstring(_some(rng, INSERTED[element.tag])))


def change_reference(rng, root):
    references = ("joint", "body1", "body2", "site1", "site2", "joint1", "tendon", "class", "site")
    pointing = [(element, key) for element in root.iter() for key in references if key in element.attrib]
    names = [element.get("name") for element in root.iter() if element.get("name")]
    if pointing:
        element, key = pointing[rng.integers(len(pointing))]
        element.set(key, _some(rng, names))


MUTATIONS = (
    *(set_value, change_number, change_number, change_number, remove_attribute, misspell, remove_element, duplicate),
    *(unname, add_attribute, add_attribute, add_attribute, add_flag, insert, insert, change_reference),
)
