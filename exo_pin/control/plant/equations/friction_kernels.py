"""Elastoplastic friction with one internal state, compiled.

Friction is force or moment (bound) z, with z' = (v - α |v| z)/δ and the presliding displacement δ. α is 0 while
|z| < 0.7 or the motion unloads, so that the joint sticks elastically and without creep, and rises to 1 at |z| = 1,
where it slides.

Source: P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, Single state elastoplastic friction models, IEEE Trans.
Automatic Control 47 (2002) 787.
"""

from __future__ import annotations

import math

from ....core.compiled import kernel

#: |z| of the friction below which it is elastic.
_ELASTIC = 0.7


@kernel
def slip(loaded: float, size: float) -> float:
    """α of the friction, for z · v and |z|."""
    if loaded <= 0.0 or size <= _ELASTIC:
        return 0.0
    if size >= 1.0:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * (size - _ELASTIC) / (1.0 - _ELASTIC))
