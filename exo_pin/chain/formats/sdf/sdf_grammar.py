"""Which elements an SDF may have, and what becomes of each: read, left out and listed, or refused.

The rules are in ``sdf_grammar.toml``. Elements that change the motion are read, or are an
error as soon as they have another value than the one without effect. Elements for drawing, contact, sensors and
programs are left out; :func:`check_grammar` lists them. So are elements of other programs, with a prefix
(``drake:...``), with a warning, because they may change the motion.
"""

from __future__ import annotations

from collections import Counter

from ....core.errors.base import echo
from ....core.errors.warning_categories import warn
from ..xml_elements import Element
from ..xml_grammar import checked, is_left_out

VERSIONS = ("1.5", "1.6", "1.7", "1.8", "1.9", "1.10", "1.11", "1.12")


def check_grammar(root: Element) -> tuple[str, ...]:
    """Check every element's attributes and children that matter, and list what is left out.

    Parameters
    ----------
    root : Element
        The document.

    Returns
    -------
    tuple of str
        What is left out, in words, by kind of element.

    Warns
    -----
    RuntimeWarning
        If elements of other programs are left out.

    Raises
    ------
    FileFormatError
        If an element or attribute is unknown, missing, there twice, or changes the motion in a way that is not read;
        or the version is not one of :data:`VERSIONS`.
    """
    if root.tag != "sdf":
        raise root.error(f"expected the root element <sdf>, got <{root.tag}>")
    version = root.attributes.get("version")
    if version not in VERSIONS:
        raise root.error(f"expected one of {', '.join(VERSIONS)}, got {version!r}: convert the file (gz sdf -p)")
    left: Counter[str] = Counter()
    for element, rule in checked(root, "sdf"):
        _refuse_other_version(element, VERSIONS.index(version) >= VERSIONS.index("1.7"), version)
        for attribute in rule.required:
            if not element.attributes[attribute]:
                raise element.error(f"the attribute {attribute!r} is empty")
        for child in element.children:
            if child.tag in rule.fixed:
                _refuse_effect(child, rule.fixed[child.tag])
        # What is drawn is carried along.
        unread = [child.tag for child in element.children if is_left_out(child, rule) and child.tag != "visual"]
        left.update(f"<{tag}> in <{element.tag}>" for tag in unread)
    prefixed = [name for name in left if ":" in name]
    if prefixed:
        warn(f"not read: {', '.join(prefixed)}, of other programs", RuntimeWarning)
    return tuple(name if count == 1 else f"{name}, {count} times" for name, count in left.items())


def flag(element: Element) -> bool:
    """The value of a truth element.

    Raises
    ------
    FileFormatError
        If it is neither true nor false.
    """
    if element.text.lower() in ("true", "1"):
        return True
    if element.text.lower() in ("false", "0"):
        return False
    raise element.error(f"expected true or false, got {echo(element.text)}")


def _refuse_other_version(element: Element, is_new: bool, version: str) -> None:
    """Raise FileFormatError for what SDF has from version 1.7 on, or up to 1.6, in a file of the other kind."""
    for attribute in ("relative_to", "expressed_in", "attached_to"):
        if not is_new and attribute in element.attributes:
            raise element.error(f"is of version 1.7; this file says {version}", attribute)
    if is_new and (element.tag == "use_parent_model_frame" or "frame" in element.attributes):
        raise element.error(f"is of version 1.6 and before; this file says {version}: use expressed_in, relative_to")


def _refuse_effect(element: Element, harmless: str) -> None:
    """Raise unless an element has the value that has no effect."""
    if element.tag == "velocity_decay":
        values = [child.text for child in element.children] or [element.text or "0"]
        fits = all(text.strip("0.+-") == "" for text in values)
    elif harmless in ("true", "false"):
        fits = flag(element) == (harmless == "true")
    else:
        fits = element.text.strip("0.+-") == ""
    if not fits:
        raise element.error(f"expected {harmless}: another value changes the motion and is not read")
