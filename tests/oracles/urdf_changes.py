"""Changes of a URDF tree: some keep its meaning, some must be refused, some give another robot."""

import copy
import xml.etree.ElementTree as ET

SAME, REFUSED, READ = "same", "refused", "read"

NUMERIC = (
    "xyz", "rpy", "value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "lower", "upper", "effort", "velocity", "damping",
    "friction", "size", "radius", "length", "rgba",
)  # fmt: skip
NO_NUMBERS = (
    "1,0", "nan", "inf", "-inf", "NaN", "0x1A", "0x1p3", "1e", "1.0kg", "1_000", "１", "1d3", "--1", "1e400", "1.0f",
    "true", "1.0.0", "e5", ".", "+", "1e+", "infinity", "1;", "'1'", "${mass}", "1/2", "1e5.0", "١",
)  # fmt: skip
SINGLE = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("parent", "child", "origin", "axis", "limit", "dynamics"),
    "visual": ("geometry", "origin"),
}
REQUIRED = {
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "parent": ("link",),
    "child": ("link",),
    "joint": ("name", "type"),
    "link": ("name",),
    "robot": ("name",),
    "axis": ("xyz",),
    "limit": ("effort", "velocity"),
    "sphere": ("radius",),
    "color": ("rgba",),
}
NEEDED = {"inertial": ("mass", "inertia"), "joint": ("parent", "child"), "visual": ("geometry",), "robot": ("link",)}


def pick(rng, items):
    return items[int(rng.integers(len(items)))]


def parents(root):
    return {child: element for element in root.iter() for child in element}


def places(root, rule):
    """Elements and attributes by a table of tag to names."""
    return [(element, name) for element in root.iter() for name in rule.get(element.tag, ()) if name in element.attrib]


def numeric(root):
    return [(element, key) for element in root.iter() for key in element.attrib if key in NUMERIC]


# What means nothing.


def comment(rng, root):
    element = pick(rng, [item for item in root.iter() if len(item)])
    thing = (
        ET.Comment(" <mimic joint='x'/> mass value='-1' ") if rng.random() < 0.7 else ET.ProcessingInstruction("x", "y")
    )
    element.insert(int(rng.integers(len(element) + 1)), thing)


def respelt(rng, root):
    for element, key in numeric(root):
        if rng.random() < 0.3:
            words = [other_spelling(rng, word) for word in element.get(key).split()]
            gap = pick(rng, ("  ", "\t", "\n", " \r\n "))
            element.set(key, pick(rng, ("", " ")) + gap.join(words) + pick(rng, ("", " ", "\n")))


def other_spelling(rng, word):
    zeros = "000" if "." in word and "e" not in word else ""
    return pick(rng, (f"{float(word):.17e}", f"{float(word):+.17E}", word, word + zeros))


def shuffled(rng, root):
    for element in [root, *root]:
        children = list(element)
        element[:] = [children[k] for k in rng.permutation(len(children))]


def extended(rng, root):
    root.insert(int(rng.integers(len(root) + 1)), ET.Element("EXTENSION"))
    pick(rng, list(root.iter("link"))).set("my_note", "1")


def pictured(rng, root):
    link = pick(rng, list(root.iter("link")))
    for tag in ("visual", "collision"):
        link.append(
            ET.fromstring(f'<{tag} name="p"><origin rpy="0 1 2"/><geometry><sphere radius="1"/></geometry></{tag}>')
        )


# What no reader may take.


def no_number(rng, root):
    element, key = pick(rng, numeric(root))
    words = element.get(key).split()
    words[int(rng.integers(len(words)))] = pick(rng, NO_NUMBERS)
    element.set(key, " ".join(words))


def miscounted(rng, root):
    element, key = pick(rng, numeric(root))
    words = element.get(key).split()
    element.set(key, " ".join(words[1:] if rng.random() < 0.5 else [*words, "0"]))


def misspelt(rng, name):
    letters = list(name)
    at = int(rng.integers(len(letters)))
    letters[at] = pick(rng, [letter for letter in "qzwkj" if letter != letters[at]])
    return "".join(letters)


def attribute_misspelt(rng, root):
    element = pick(rng, [item for item in root.iter() if item.attrib])
    key = pick(rng, list(element.attrib))
    element.set(misspelt(rng, key), element.attrib.pop(key))


def element_misspelt(rng, root):
    element = pick(rng, list(root.iter()))
    element.tag = misspelt(rng, element.tag)


def twice(rng, root):
    found = [(item, child) for item in root.iter() for child in item if child.tag in SINGLE.get(item.tag, ())]
    found += [(root, child) for child in root if child.tag in ("link", "joint")]
    element, child = pick(rng, found)
    other = copy.deepcopy(child)
    for item, key in numeric(other):
        item.set(key, " ".join(repr(0.5 * float(word)) for word in item.get(key).split()))
    element.append(other)


def attribute_missing(rng, root):
    element, key = pick(rng, places(root, REQUIRED))
    del element.attrib[key]


def element_missing(rng, root):
    found = [(item, child) for item in root.iter() for child in item if child.tag in NEEDED.get(item.tag, ())]
    element, child = pick(rng, found)
    element.remove(child)


def below_zero(rng, root):
    rule = {"mass": ("value",), "limit": ("effort", "velocity"), "dynamics": ("damping", "friction")}
    element, key = pick(rng, places(root, rule))
    element.set(key, repr(-float(element.get(key)) - 1e-9))


def no_body(rng, root):
    inertia = pick(rng, list(root.iter("inertia")))
    key = pick(rng, ("ixx", "iyy", "izz"))
    values = [float(inertia.get(entry)) for entry in ("ixx", "iyy", "izz")]
    inertia.set(key, repr(pick(rng, (-0.1, 3.0)) * sum(values)))


def massless(rng, root):
    pick(rng, list(root.iter("mass"))).set("value", "0")


def upside_down(rng, root):
    limit = pick(rng, [item for item in root.iter("limit") if "lower" in item.attrib])
    lower, upper = limit.get("lower"), limit.get("upper")
    limit.set("lower", upper)
    limit.set("upper", lower)


def unknown_link(rng, root):
    end = pick(rng, [*root.iter("parent"), *root.iter("child")])
    end.set("link", pick(rng, ("nobody", "", "universe", end.get("link") + " ")))


def not_a_tree(rng, root):
    children = list(root.iter("child"))
    one, other = (children[int(k)] for k in rng.permutation(len(children))[:2])
    kind = int(rng.integers(3))
    if kind == 0:
        one.set("link", other.get("link"))
    elif kind == 1:
        joint = parents(root)[one]
        joint.find("parent").set("link", one.get("link"))
    else:
        root.append(ET.Element("link", name="lonely"))


def unknown_type(rng, root):
    pick(rng, root.findall("joint")).set("type", pick(rng, ("ball", "Revolute", "", "spherical", "hinge", " fixed")))


def no_direction(rng, root):
    moving = [joint for joint in root.iter("joint") if joint.get("type") in ("revolute", "prismatic", "continuous")]
    pick(rng, moving).find("axis").set("xyz", pick(rng, ("0 0 0", "0 -0.0 0", "0 0 1e-300")))


def nameless(rng, root):
    pick(rng, [item for item in root.iter() if item.tag in ("link", "joint", "robot")]).set("name", "")


def with_text(rng, root):
    pick(rng, list(root.iter())).text = pick(rng, ("1.0", "x", ">"))


def limitless(rng, root):
    joint = pick(rng, [item for item in root.iter("joint") if item.get("type") in ("revolute", "prismatic")])
    joint.remove(joint.find("limit"))


def mimicking(rng, root):
    joint = pick(rng, list(root.iter("joint")))
    joint.append(ET.Element("mimic", joint=pick(rng, ("nobody", joint.get("name"))), multiplier="1"))


def in_xacro(rng, root):
    root.append(ET.Element("xacro:include", filename="x"))


# What is another robot, if it is one.


def scaled(rng, root):
    element, key = pick(
        rng, [(item, key) for item, key in numeric(root) if item.tag in ("origin", "axis", "limit", "mass")]
    )
    factor = 10.0 ** rng.uniform(-6, 6) * (1 if rng.random() < 0.8 else -1)
    element.set(key, " ".join(repr(factor * float(word)) for word in element.get(key).split()))


def left_out(rng, root):
    optional = {"link": ("inertial",), "joint": ("origin", "axis", "dynamics", "limit"), "inertial": ("origin",)}
    found = [(item, child) for item in root.iter() for child in item if child.tag in optional.get(item.tag, ())]
    element, child = pick(rng, found)
    element.remove(child)


def retyped(rng, root):
    kinds = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
    pick(rng, list(root.iter("joint"))).set("type", pick(rng, kinds))


def rehung(rng, root):
    pick(rng, list(root.iter("parent"))).set("link", pick(rng, list(root.iter("link"))).get("name"))


def renamed(rng, root):
    old, new = pick(rng, list(root.iter("link"))).get("name"), pick(rng, ("é & <ü>", "a b", "ロボット", "j0x", '"'))
    for element in root.iter():
        for key in ("name", "link"):
            if element.tag in ("link", "parent", "child") and element.get(key) == old:
                element.set(key, new)


def bent(rng, root):
    inertia = pick(rng, list(root.iter("inertia")))
    key = pick(rng, ("ixy", "ixz", "iyz"))
    inertia.set(key, repr(rng.normal() * float(inertia.get("ixx"))))


CHANGES = {
    SAME: (comment, respelt, shuffled, extended, pictured),
    REFUSED: (
        no_number, no_number, no_number, miscounted, attribute_misspelt, element_misspelt, twice, attribute_missing,
        element_missing, below_zero, no_body, massless, upside_down, unknown_link, not_a_tree, unknown_type,
        no_direction, nameless, with_text, limitless, mimicking, in_xacro,
    ),
    READ: (scaled, scaled, left_out, retyped, rehung, renamed, bent),
}  # fmt: skip
