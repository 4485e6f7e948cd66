"""The check of one element against a rule: what is required, allowed, there once, left out and refused."""

import pytest

from exo_pin import FileFormatError
from exo_pin.chain.formats.xml_elements import Element, Rule, _read_children, checked, is_left_out, parse_xml

RULE = Rule(
    required=("name",), optional=("type",), others=("id",), once=("axis",), often=("mesh",), needed=("axis",),
    left_out=("plugin",), named={"gravity": "gravcomp"},
)  # fmt: skip


def children(text, rule=RULE):
    return [child.tag for child in _read_children(parse_xml(text), rule)]


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ('<a name="x" type="y" id="z" p:q="1" xmlns="u"><axis/></a>', ["axis"]),
        ('<a name="x"><mesh/><axis/><mesh/><gravity/></a>', ["mesh", "axis", "mesh"]),
        # One that says the same again is read once; of what may be there often each one.
        ('<a name="x"><axis k="1"/><axis k="1"/></a>', ["axis"]),
        ('<a name="x"><axis/><plugin/><drake:x/><mesh/></a>', ["axis", "mesh"]),
    ],
)
def test_children_that_are_read(text, read):
    assert children(text) == read


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<a><axis/></a>", "line 1: a: the attribute 'name' is missing$"),
        ('<a nane="x"><axis/></a>', "the attribute 'name' is missing; there is 'nane'"),
        (
            '<a name="x" tipe="y"><axis/></a>',
            r"unknown attribute 'tipe' .*did you mean 'type'.*there are: name, type, id",
        ),
        ('<a name="x">text<axis/></a>', "expected no text in <a>, got 'text'"),
        ('<a name="x"><axis/><axes/></a>', r"unknown element <axes>.*there are: axis, mesh, plugin, gravity"),
        ('<a name="x"><axis k="1"/>\n<axis k="2"/></a>', "line 2: axis: expected one <axis>.*first is on line 1"),
        ('<a name="x"><mesh/></a>', "line 1: a: <axis> is missing"),
    ],
)
def test_what_is_refused_and_where(text, said):
    with pytest.raises(FileFormatError, match=said):
        children(text)


def test_what_is_no_known_name_is_told_and_one_that_is_nearly_known_an_error():
    told = []
    element = parse_xml('<a name="x" colour="y">text<axis/><foreign><b/></foreign></a>')
    assert [child.tag for child in _read_children(element, RULE, lambda *strange: told.append(strange))] == ["axis"]
    assert told == [
        ("colour", "attribute 'colour' in <a>"), ("text", "text in <a>"), ("foreign", "element <foreign> in <a>"),
    ]  # fmt: skip
    for near in (
        '<a name="x" tipe="y"><axis/></a>',
        '<a name="x"><axis/><axes/></a>',
        '<a name="x"><axis/><gravty/></a>',
    ):
        with pytest.raises(FileFormatError, match="did you mean"):
            _read_children(parse_xml(near), RULE, lambda *strange: None)


@pytest.mark.parametrize(
    "text",
    [
        "<a><!-- --option --><b>1</b></a>", "\n<!-- x -->\n<?xml version='1.0'?><a><b>1</b></a>",
        "<a><b><![CDATA[1]]></b></a>", "<a><!-- a -- b\n--\n--><b><![CDATA[1]]></b></a>",
    ],
)  # fmt: skip
def test_xml_is_read_as_tinyxml_reads_it(text):
    for source in (text, text.encode()):
        root = parse_xml(source)
        assert [(child.tag, child.text) for child in root.children] == [("b", "1")]
        assert root.children[0].line == 1 + text[: text.index("<b>")].count("\n")


def test_an_element_that_knows_nothing():
    with pytest.raises(FileFormatError, match="unknown attribute 'k'; there are: none"):
        children('<a k="1"/>', Rule())
    assert children("<a>text</a>", Rule(text=True)) == []


def test_children_of_other_programs_are_left_out():
    for tag, left in (("plugin", True), ("drake:x", True), ("axis", False), ("unknown", False)):
        assert is_left_out(Element(tag, {}, 1, tag), RULE) == left


ROBOT = """<robot name="r"><link name="a"><visual><geometry><sphere size="1"/></geometry></visual>
</link>{}</robot>"""


def test_faults_of_pictures_are_told_and_others_raised():
    told = []
    read = [element.tag for element, _ in checked(parse_xml(ROBOT.format("")), "urdf", told.append)]
    assert read[:4] == ["robot", "link", "visual", "geometry"]
    assert "sphere" not in read
    assert len(told) == 1
    assert "sphere" in str(told[0])
    with pytest.raises(FileFormatError, match="sphere"):
        list(checked(parse_xml(ROBOT.format("")), "urdf"))
    with pytest.raises(FileFormatError, match="unknown element <lnk>"):
        list(checked(parse_xml(ROBOT.format("<lnk/>")), "urdf", told.append))
