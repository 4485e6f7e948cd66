"""Answers as HTML: every text comes from the package, escaped."""

from __future__ import annotations

from html import escape

import numpy as np

from ..core.tables import newtons
from ..exo.pose_report import PoseReport
from .following import Shown

#: Sign and class of a verdict: shape tells them apart as well as colour does.
_LOOKS = {
    "NOT KNOWN": ("?", "unknown"),
    "YES": ("✓", "yes"),
    "IT SUPPORTS": ("✓", "yes"),
    "IT WOULD": ("!", "unknown"),
}
_NO = ("✗", "no")


def answer_html(shown: Shown) -> str:
    """The first answer, laid out: verdict, the numbers that matter most, drives, and the other lines."""
    if shown.parts is None or shown.report is None:
        return (
            "<div class='verdict unknown'><span class='sign' aria-hidden='true'>!</span>"
            f"<div><b>No answer</b><p>{escape(shown.refusal)}</p></div></div>"
        )
    parts = shown.parts
    begins = (look for word, look in _LOOKS.items() if parts.verdict.startswith(word))
    sign, look = next(begins, _NO)
    blocks = [
        f"<div class='verdict {look}'><span class='sign' aria-hidden='true'>{sign}</span>"
        f"<div><b>{escape(parts.verdict)}</b><p>{escape(parts.reason)}</p></div></div>",
        f"<div class='figures'>{''.join(map(_figure, figures(shown.report)))}</div>",
    ]
    if parts.drives:
        rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in parts.drives)
        head = "".join(f"<th scope='col'>{name}</th>" for name in ("Drive", "Effort", "Limit", "Position"))
        blocks.append(f"<table class='drives'><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>")
    texts = "".join(f"<dt>{escape(label)}</dt><dd>{escape(text)}</dd>" for label, text in parts.lines if label)
    above = "".join(f"<p class='remedy'>{escape(text)}</p>" for label, text in parts.lines if not label)
    return "".join([blocks[0], above, *blocks[1:], f"<dl class='lines'>{texts}</dl>"])


def figures(report: PoseReport) -> list[tuple[str, str, str]]:
    """Number, unit and name of what is read first: fields of the report, in three digits at most."""
    found, contact = [], report.contact
    if contact is not None and contact.has_result:
        name = "in the joint with it" if contact.held else "in the joint, as near as it can"
        found.append((newtons(float(contact.magnitude)), "N", name))
    if contact is not None and contact.without_device is not None and contact.without_device.has_result:
        found.append((newtons(float(contact.without_device.magnitude)), "N", "without the device"))
    if report.answer.has_answer:
        found.append((newtons(float(report.answer.magnitude)), "N", "of arm and device alone"))
        clearance = float(report.answer.clearance)
        if np.isfinite(clearance):
            found.append((f"{1e3 * clearance:.0f}".replace("-", "−"), "mm", "clear of the body"))
    return found


def _figure(figure: tuple[str, str, str]) -> str:
    number, unit, name = figure
    return f"<div><span class='number'>{escape(number)}<small> {escape(unit)}</small></span>{escape(name)}</div>"
