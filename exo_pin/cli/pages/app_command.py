"""``exo-pin app``: person, device, pose and answer on one page in the browser."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Annotated

from ...app.asked import Asked
from ...app.serving import serve_app
from ...core.optional_packages import require_extra
from ...design import DEFAULT_PRESET
from .. import options


def app(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    worn: options.Someone = options.Someone(),
    strength: options.Percent = 100.0,
    port: Annotated[int | None, options.called("N")] = None,
    open: bool = False,
) -> None:
    """Ask about a person and a device on one page in the browser, which answers while one drags.

    The page is served on this machine alone, until Ctrl-C is pressed (needs the extra 'app').

    Parameters
    ----------
    strength : float
        Strength of the person's muscles, percent (0 for an arm without muscle force).
    port : int, optional
        First port to try (default 7100).
    open : bool
        Open the page in a browser.

    Examples
    --------
    exo-pin app --open
    exo-pin app four-cables --person 1.60,45,female --strength 0 --flexion 60 --open
    """
    require_extra("app")
    exo, size = worn.load(design, side), worn.size
    asked = Asked(
        design, (), exo.side, size.height, size.mass, size.sex, math.degrees(size.elbow_flexion), size.payload,
        strength, 1e3 * (size.arm_girth or 0.0), 1e3 * size.clothing, *pose.angles,
    )  # fmt: skip
    with suppress(KeyboardInterrupt):
        serve_app(asked, port, open, lambda text: print(text, flush=True))
