"""The pages of a report: PDF by fpdf2, and HTML; both from the same sections."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.files import require_ending, write_bytes, write_text
from ..core.optional_packages import optional
from .content import PagePart, foot_words, head_words, sections_of

if TYPE_CHECKING:
    from .record import DesignReport

ENDINGS = (".pdf", ".html")
#: Margins and width of the print on A4, mm; sizes of print, points; and factors by which all print is made smaller.
_MARGIN, _WIDE = 12.0, 186.0
_TITLE, _TEXT, _TABLE, _SMALL = 14.0, 9.0, 7.8, 7.0
_SMALLER = (1.0, 0.95, 0.9, 0.85, 0.8)
_PAGES = 2
_STYLE = """
body { font: 15px/1.4 sans-serif; max-width: 1000px; margin: 2em auto; padding: 0 1em; color: #111; }
h1 { font-size: 1.5em; margin: 0; } h2 { font-size: 1.1em; margin: 1.4em 0 0.3em; border-bottom: 1px solid #33445A; }
table { border-collapse: collapse; width: 100%; font-size: 0.85em; }
th, td { text-align: right; padding: 0.2em 0.5em; border-bottom: 1px solid #ddd; vertical-align: top; }
td.words, th.words { text-align: left; }
img { width: 100%; } .small { font-size: 0.8em; color: #444; } .verdict { font-weight: bold; }
@media print { body { font-size: 10px; margin: 0; } }
"""


def save(report: DesignReport, path: str | PathLike[str]) -> None:
    """Write the pages; see :meth:`.DesignReport.save`."""
    target = Path(path)
    require_ending("the report", target, ENDINGS)
    if target.suffix.lower() == ".html":
        write_text(target, html_page(report))
    else:
        write_bytes(target, pdf_pages(report))


def html_page(report: DesignReport) -> str:
    """The report as one page that needs no other file."""
    title, below = head_words(report)
    picture = base64.b64encode(report.picture).decode()
    parts = [
        f"<h1>{escape(title)}</h1><p>{escape(below)}</p><p class='verdict'>{escape(report.verdict)}</p>",
        f"<img alt='The device in three postures' src='data:image/png;base64,{picture}'>",
        *map(_html_section, sections_of(report)),
        f"<p class='small'>{escape(foot_words(report))}</p>",
    ]
    head = f"<meta charset='utf-8'><title>{escape(title)}</title><style>{_STYLE}</style>"
    return f"<!DOCTYPE html>\n<html lang='en'><head>{head}</head><body>\n" + "\n".join(parts) + "\n</body></html>\n"


def _html_section(section: PagePart) -> str:
    parts = [f"<h2>{escape(section.title)}</h2>", *(f"<p>{escape(text)}</p>" for text in section.texts)]
    if section.rows:
        head, *rows = (_html_row(section, row) for row in (section.head, *section.rows))
        head = head.replace("<td", "<th").replace("</td", "</th")
        parts.append(f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>")
    parts += [f"<p class='small'>{escape(section.source)}</p>"] if section.source else []
    return "".join(parts)


def _html_row(section: PagePart, row: Sequence[str]) -> str:
    looks = [" class='words'" if k < section.words else "" for k in range(len(row))]
    return f"<tr>{''.join(f'<td{look}>{escape(cell)}</td>' for cell, look in zip(row, looks, strict=True))}</tr>"


def pdf_pages(report: DesignReport) -> bytes:
    """The report on two A4 pages: print is made smaller, down to four fifths, until it fits."""
    for smaller in _SMALLER:
        pdf = _Print(report, smaller)
        if pdf.pages <= _PAGES:
            break
    return pdf.data


class _Print:
    """The pages in one size of print."""

    def __init__(self, report: DesignReport, smaller: float) -> None:
        fpdf = optional("report", "fpdf")
        self._face: Any = optional("report", "fpdf.fonts").FontFace
        self._smaller = smaller
        self._pdf: Any = fpdf.FPDF(format="A4")
        # matplotlib brings fonts with all signs that are printed.
        fonts = Path(optional("report", "matplotlib").get_data_path(), "fonts", "ttf")
        self._pdf.add_font("body", "", fonts / "DejaVuSans.ttf")
        self._pdf.add_font("body", "B", fonts / "DejaVuSans-Bold.ttf")
        self._pdf.set_margins(_MARGIN, _MARGIN)
        self._pdf.set_auto_page_break(True, margin=_MARGIN)
        self._pdf.footer = lambda: self._footer(foot_words(report))
        self._pdf.set_title(report.title)
        self._pdf.set_creator(f"exo_pin {report.version}")
        self._pdf.add_page()
        title, below = head_words(report)
        self._text(title, _TITLE, bold=True)
        self._text(below, _TEXT)
        self._text(report.verdict, _TEXT, bold=True)
        self._pdf.image(io.BytesIO(report.picture), w=_WIDE)
        for section in sections_of(report):
            self._whole(section)
        self.pages = int(self._pdf.page)
        self.data = bytes(self._pdf.output())

    def _font(self, points: float, bold: bool = False) -> float:
        """Choose a font, and return the height of its lines, mm."""
        size = points * self._smaller
        self._pdf.set_font("body", "B" if bold else "", size)
        return 0.44 * size

    def _text(self, text: str, points: float, bold: bool = False) -> None:
        height = self._font(points, bold)
        self._pdf.multi_cell(_WIDE, height, text, align="L", new_x="LMARGIN")

    def _footer(self, text: str) -> None:
        self._pdf.set_y(-_MARGIN + 3.0)
        self._pdf.set_font("body", "", 6.5)
        self._pdf.cell(_WIDE / 2.0, 3.0, text)
        self._pdf.cell(_WIDE / 2.0, 3.0, f"page {self._pdf.page} of {_PAGES}", align="R")

    def _whole(self, section: PagePart) -> None:
        """A section on one page, on the next where it does not fit."""
        with self._pdf.offset_rendering() as tried:
            self._section(section, tried)
        if tried.page_break_triggered:
            self._pdf.add_page()
        self._section(section, self._pdf)

    def _section(self, section: PagePart, pdf: Any) -> None:
        kept, self._pdf = self._pdf, pdf
        pdf.ln(1.6 * self._smaller)
        self._text(section.title, _TEXT, bold=True)
        for text in section.texts:
            self._text(text, _TABLE)
        if section.rows:
            self._table(section)
        if section.source:
            self._text(section.source, _SMALL)
        self._pdf = kept

    def _table(self, section: PagePart) -> None:
        height, sides = self._font(_TABLE), ["LEFT"] * section.words
        with self._pdf.table(
            width=_WIDE,
            col_widths=section.widths,
            text_align=(*sides, *["RIGHT"] * (len(section.head) - section.words)),
            line_height=height,
            padding=(0.3, 0.6),
            borders_layout="HORIZONTAL_LINES",
            headings_style=self._face(emphasis="BOLD", fill_color=(232, 236, 242)),
            v_align="TOP",
        ) as table:
            for row in (section.head, *section.rows):
                table.row(list(row))
