"""Standard output of a command: nothing that moves the cursor, and no sign that the terminal cannot show."""

from __future__ import annotations

import codecs
import contextlib
import io
import re
import sys
import unicodedata

#: Control characters but for tab and the ends of lines: a name in a file may hold them.
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
#: Signs of this package's texts whose parts are no ASCII.
_ASCII = (
    {"°": " deg", "±": "+-", "×": "x", "·": "*", "→": "->", "≤": "<=", "≥": ">=", "−": "-", "–": "-", "—": "-"}
    | {"∞": "inf", "≈": "~", "√": "sqrt", "∂": "d", "Δ": "Delta", "θ": "theta", "φ": "phi", "Φ": "Phi", "α": "alpha"}
    | {"β": "beta", "λ": "lambda", "τ": "tau", "ω": "omega", "σ": "sigma", "µ": "u", "μ": "u", "⊥": "perpendicular"}
)
_HANDLER = "exo_pin.plain_signs"


class _Printable(io.TextIOWrapper):
    def write(self, text: str) -> int:
        return super().write(_CONTROL.sub(lambda sign: repr(sign[0])[1:-1], text))


def make_output_printable() -> None:
    """Replace standard output by one that shows control characters as escapes and other signs as the terminal can."""
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper):
        return
    codecs.register_error(_HANDLER, _plain_signs)
    with contextlib.suppress(OSError):
        out.flush()
    sys.stdout = _Printable(out.buffer, out.encoding, _HANDLER, line_buffering=out.line_buffering)


def _plain_signs(error: UnicodeError) -> tuple[str, int]:
    """The handler of signs that an encoding lacks: in ASCII words, or as escapes."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_plain_sign, error.object[error.start : error.end])), error.end


def _plain_sign(sign: str) -> str:
    if sign in _ASCII:
        return _ASCII[sign]
    parts = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return parts or sign.encode("ascii", "backslashreplace").decode()
