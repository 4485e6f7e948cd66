"""``exo-pin view``: the design in three dimensions, live, as a page or as a picture."""

from __future__ import annotations

import threading
import webbrowser
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter
from scipy.spatial.transform import Rotation, Slerp

from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput, MissingExtra
from ..core.optional_packages import require_extra
from ..core.validation import FloatArray, as_positive
from ..design import DEFAULT_PRESET
from ..view import LIMB_STYLES, ChainScene, Scene
from ..view.page.browser import find_browser
from . import options
from .command import check_file
from .robot_commands import joint_value

if TYPE_CHECKING:
    #: Poses of a motion, and their times.
    _Path = tuple[Any, FloatArray]
    #: Width and height of the page, and pixels of the picture for each of its.
    _Size = tuple[tuple[int, int], float]

_FRAMES_A_SECOND = 30
#: What --plot writes.
_FILES = (".html", ".png")
#: Duration of a motion, s, and size of a picture, where they are not said.
_SECONDS, _PIXELS = 3.0, "1280x800"


def view(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    to: Annotated[str | None, options.called("F,A,I")] = None,
    seconds: options.Seconds = _SECONDS,
    set: options.Joints = (),
    worn: options.Worn = options.Worn(),
    limbs: Annotated[str, Parameter(choices=tuple(LIMB_STYLES))] = "rods",
    mannequin: bool = False,
    no_human: bool = False,
    scale: options.Newtons | None = None,
    size: Annotated[str, options.called("WxH")] = _PIXELS,
    port: Annotated[int | None, options.called("N")] = None,
    open: bool = False,
    plot: Annotated[
        Path | None, Parameter(metavar="FILE", validator=partial(check_file, "--plot", _FILES, False))
    ] = None,
) -> None:
    """Show the design on a person with its forces, in three dimensions.

    Without --plot a live page is served on this machine until Ctrl-C is pressed. A robot without an arm, and a
    configuration of any that --set names, is drawn with its links and closures.

    Parameters
    ----------
    to : str, optional
        Move from the pose to these angles: flexion, abduction and internal rotation, degrees; forces are those at rest
        in every pose.
    seconds : float
        Duration of the motion of --to, s.
    limbs : str
        How limbs are drawn.
    mannequin : bool
        With --person: draw a human figure instead of bones and muscles (those need the extra 'person').
    no_human : bool
        Draw no person.
    scale : float, optional
        Force shown by an arrow of 10 cm, N (default: chosen from the largest force).
    size : str
        Size of the picture of --plot, pixels; 1280x800@2 draws the same with twice as many each way.
    port : int, optional
        First port to try for the live page (default 7000).
    open : bool
        Open the live page in a browser.
    plot : Path, optional
        Write a page that opens without a network (.html), or a still picture (.png; needs a headless browser).

    Examples
    --------
    exo-pin view four-cables --person 1.75,75,male --flexion 60 --open
    exo-pin view four-cables --to 90,0,0 --plot lift.html
    """
    is_picture = plot is not None and plot.suffix.lower() == ".png"
    if to is None:
        options.refuse("--to was not given", seconds=None if seconds == _SECONDS else seconds)
    if is_picture:
        options.refuse("a picture shows one pose", to=to)
    else:
        options.refuse("no picture is drawn", size=None if size == _PIXELS else size)
    if plot is not None:
        options.refuse("--plot writes a file and serves no page", port=port, open=open)
    exo, pixels = worn.load(design, side), _size(size)
    scene: Scene | ChainScene
    path: _Path | None = None
    if set or not (exo.has_arm or exo.wrist is not None):
        if exo.wrist is not None:
            raise InvalidInput("--set is for robots that are not wrists: give a wrist's pose by --flexion and so on")
        why = f"{exo.name} is drawn by its joints, without person and forces: give them by --set"
        style = None if limbs == "rods" else limbs
        options.refuse(why, **options.given(pose), scale=scale, to=to, person=worn.person, limbs=style)
        scene = ChainScene(exo.chain, exo.urdf)
        scene.move({joint: value for joint, value, _ in map(joint_value, set)})
        said = [f"{exo.name}: drawn as a closed chain, without forces", *scene.messages]
    else:
        if is_picture:
            find_browser()  # a missing one is told before anything is drawn
        drawn = worn.person is not None and not mannequin and not no_human
        looks: dict[str, Any] = {}
        if drawn:
            try:
                require_extra("person")
                looks = {"person": worn.muscles()}
            except MissingExtra as error:
                options.caution(f"bones and muscles are not drawn: {error}")
        arrow = None if scale is None else 0.1 / as_positive("--scale", scale)
        scene = Scene(exo, human=False if no_human else None, limbs=limbs, metres_per_newton=arrow, **looks)
        start = pose.of(exo)
        answer = scene.show(start)
        path = None if to is None else _path(start, _angles("--to", to, exo.side), seconds)
        verdict = "" if answer is None else answer.verdict
        said = [*(text for text in scene.messages if text not in verdict), *([verdict] if verdict else [])]
    if plot is None:
        _serve(scene, path, said, port, open)
        return
    if is_picture:
        page, ratio = pixels
        scene.save_png(plot, page, pixel_ratio=ratio)
    elif path is None:
        scene.save_html(plot)
    else:
        scene.record(*path).save(plot)
    print(*said, plot, sep="\n")


def _serve(scene: Scene | ChainScene, path: _Path | None, said: list[str], port: int | None, opened: bool) -> None:
    """A live page, until Ctrl-C is pressed."""
    with closing(scene), suppress(KeyboardInterrupt):
        print(f"{scene.serve(port)} (Ctrl-C ends it)", *said, sep="\n", flush=True)
        if opened:
            webbrowser.open(scene.url)
        if path is not None:
            scene.play(*path)
        threading.Event().wait()


def _angles(option: str, text: str, side: str) -> Rotation:
    flexion, abduction, internal = options.triple(option, text)
    return shoulder_rotation(flexion, abduction, internal, side=side, degrees=True)


def _path(start: Rotation, end: Rotation, seconds: float) -> _Path:
    """The shortest turn from one pose to another, at an even pace."""
    end_time = options.duration("--seconds", seconds)
    times = np.linspace(0.0, end_time, max(round(end_time * _FRAMES_A_SECOND), 1) + 1)
    return Slerp([0.0, end_time], Rotation.concatenate([start, end]))(times), times


def _size(text: str) -> _Size:
    """Size of the page, and pixels of the picture for each of it: 1120x760, 1120x760@2."""
    page, _, ratio = text.partition("@")
    try:
        width, height = (int(part) for part in page.split("x"))
        return (width, height), float(ratio or 1.0)
    except ValueError:
        raise InvalidInput(f"expected --size WIDTHxHEIGHT in pixels, or WIDTHxHEIGHT@2, got {text!r}") from None
