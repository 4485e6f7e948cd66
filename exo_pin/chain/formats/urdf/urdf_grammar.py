"""Which elements and attributes a URDF may have, and where.

Pinocchio's URDF reader drops what it does not know, so a misspelt ``<axis xqz=...>`` would be read as no axis at all;
here it is an error. The rules are in ``urdf_grammar.toml``.

Extensions of other programs are not read: every element and attribute with a prefix (``drake:...``), except
xacro's, which have to be expanded first, and those without a prefix that are common in published files.
"""

from __future__ import annotations

from ..xml_elements import Element
from ..xml_grammar import read_children, read_rules

__all__ = ["check_grammar"]


def check_grammar(root: Element) -> None:
    """Check every element's attributes and children; their values are not checked.

    Raises
    ------
    FileFormatError
        As :func:`exo_pin.chain.formats.xml_grammar.read_children`.
    """
    if root.tag != "robot":
        raise root.error(f"expected the root element <robot>, got <{root.tag}>")
    rules, waiting = read_rules("urdf"), [root]
    while waiting:
        element = waiting.pop()
        for child in element.children:
            if child.tag.startswith("xacro:"):
                raise child.error("the file still has xacro in it; expand it first (ros2 run xacro xacro ...)")
        waiting += reversed(read_children(element, rules[element.tag]))
