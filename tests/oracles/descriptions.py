"""Descriptions of pictures and answers as plain data: numbers, words, how two differ, and how they are written."""

import json
import math
import re

import numpy as np

#: Share by which a number of a picture may differ: other platforms round otherwise.
CLOSE = 1e-3
#: A number within a text.
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
#: Data of more numbers are described by samples.
_WHOLE = 24


def rounded(value, digits=5):
    """A number with so many digits, None where it is not finite."""
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None


def numbers(values, digits=5):
    """Numbers of any shape: all where they are few, else how many, mean, spread and some of them."""
    data = np.asarray(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan))
    if data.ndim == 0:
        return rounded(float(data), digits)
    if not data.size:
        return []
    rows = data.reshape(len(data), -1) if data.ndim == 2 and data.shape[1] < 5 else data.reshape(-1, 1)
    if data.size <= _WHOLE:
        return [
            [rounded(value, digits) for value in row] if len(row) > 1 else rounded(row[0], digits)
            for row in rows.tolist()
        ]
    known = np.isfinite(rows)
    some = rows[np.linspace(0, len(rows) - 1, 5).round().astype(int)]
    found = {"shape": list(data.shape), "known": int(known.sum())}
    for name, figure in (("mean", np.nanmean), ("spread", np.nanstd)):
        found[name] = [rounded(figure(column), digits) if np.isfinite(column).any() else None for column in rows.T]
    return found | {"some": [rounded(value, digits) for value in some.ravel()]}


def differences(stored, found, where="", close=CLOSE):
    """What differs between two descriptions, a line each; numbers may differ by a share."""
    if isinstance(stored, dict) and isinstance(found, dict):
        for name in (*stored, *(name for name in found if name not in stored)):
            yield from differences(stored.get(name), found.get(name), f"{where} {name}".strip(), close)
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        size = max((abs(each) for each in stored if isinstance(each, float | int)), default=0.0)
        for k, (one, two) in enumerate(zip(stored, found, strict=True)):
            if not _close(one, two, size, close):
                yield from differences(one, two, f"{where}[{k}]", close)
    elif not _close(stored, found, 0.0, close):
        was, now = (json.dumps(each, ensure_ascii=False)[:300] for each in (stored, found))
        yield f"{where}: {was} is now {now}"


def _close(stored, found, size, close):
    """Whether two values are the same; a number near zero as its neighbours are, in a text to its last digit."""
    if isinstance(stored, float | int) and isinstance(found, float | int) and not isinstance(stored, bool):
        return abs(stored - found) <= close * abs(stored) + 1e-6 * size + 1e-7
    if isinstance(stored, str) and isinstance(found, str) and stored != found:
        same_words = _NUMBER.sub("#", stored) == _NUMBER.sub("#", found)
        return same_words and all(map(_same_digits, _NUMBER.findall(stored), _NUMBER.findall(found)))
    return stored == found


def _same_digits(stored, found):
    mantissa, _, exponent = stored.partition("e")
    last = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(float(stored) - float(found)) <= (1.01 * last if set("e.") & set(stored) else 0.0)


def written(description, indent=0):
    """JSON in which what is short, or is all numbers, stands on one line."""
    line = json.dumps(description, ensure_ascii=False, default=lambda value: value.item())
    space = "\n" + " " * (indent + 1)
    if isinstance(description, dict) and len(line) + indent > 150:
        rows = (
            f"{json.dumps(key, ensure_ascii=False)}: {written(each, indent + 1)}" for key, each in description.items()
        )
        return f"{{{space}{f',{space}'.join(rows)}}}"
    if isinstance(description, list) and any(isinstance(each, dict) for each in description):
        return f"[{space}{f',{space}'.join(written(each, indent + 1) for each in description)}]"
    return line
