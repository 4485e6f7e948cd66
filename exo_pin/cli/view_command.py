"""``exo-pin view``: the design in three dimensions, live, as a page or as a picture."""

from __future__ import annotations

import argparse
import threading
import webbrowser
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput, MissingExtra
from ..core.optional_packages import require_extra
from ..core.validation import FloatArray, as_positive
from ..exo.shoulder_exo import ShoulderExo
from .options.query_options import caution, design, duration, joint_value, pose, refuse, triple, wearer

if TYPE_CHECKING:
    from ..person import Person
    from ..view import ChainScene, Scene

    #: Poses of a motion, and their times.
    _Path = tuple[Any, FloatArray]
    #: Width and height of the page, and pixels of the picture for each of its.
    _Size = tuple[tuple[int, int], float]

_FRAMES_A_SECOND = 30


def run_view(options: argparse.Namespace) -> int:
    """Answer ``exo-pin view`` and return its exit status."""
    exo = design(options)
    if exo.has_arm or exo.wrist is not None:
        if not options.set:
            return _view_device(exo, options)
        if exo.wrist is not None:
            raise InvalidInput("--set is for robots that are not wrists: give a wrist's pose by --flexion and so on")
    return _view_chain(exo, options)


def _view_device(exo: ShoulderExo, options: argparse.Namespace) -> int:
    """A device on a person, in a pose or a motion, with its forces."""
    from ..view import Scene
    from ..view.page.browser import find_browser

    start = pose(options, exo)
    size = _size(options.size)
    if options.plot is not None and options.plot.suffix.lower() == ".png":
        find_browser()  # a missing one is told before anything is drawn
    scale = None if options.scale is None else 0.1 / as_positive("--scale", options.scale)
    human = False if options.no_human else None
    looks: dict[str, Any] = {}
    drawn = not options.mannequin and not options.no_human
    if options.bare and (options.person is None or not drawn):
        raise InvalidInput("--bare draws a person's bones and muscles: give --person, and no other figure")
    if options.person is not None:
        person = _wearer(options) if drawn else None
        if person is not None:
            looks = {"person": person, "device": not options.bare}
    scene = Scene(exo, human=human, limbs=options.limbs, metres_per_newton=scale, **looks)
    answer = scene.show(start)
    path = None if options.to is None else _path(start, _angles("--to", options.to, exo.side), options.seconds)
    verdict = "" if answer is None else answer.verdict
    said = [*(text for text in scene.messages if text not in verdict), *([verdict] if verdict else [])]
    return _deliver(scene, options, size, path, said)


def _wearer(options: argparse.Namespace) -> Person | None:
    """The person with muscles, where the extra is installed."""
    try:
        require_extra("person")
    except MissingExtra as error:
        if options.bare:
            raise
        caution(f"bones and muscles are not drawn: {error}")
        return None
    return wearer(options)


def _view_chain(exo: ShoulderExo, options: argparse.Namespace) -> int:
    """A robot without an arm, or a configuration of any: its links and closures."""
    from ..view import ChainScene

    scene = ChainScene(exo.chain, exo.urdf)
    why = f"{exo.name} is drawn by its joints, without person and forces: give them by --set"
    refuse(options, why, "flexion", "abduction", "internal_rotation", "scale", "to", "person")
    if options.set:
        scene.move(dict(joint_value(text) for text in options.set))
    said = [f"{exo.name}: drawn as a closed chain, without forces", *scene.messages]
    return _deliver(scene, options, _size(options.size), None, said)


def _deliver(
    scene: Scene | ChainScene, options: argparse.Namespace, size: _Size, path: _Path | None, said: list[str]
) -> int:
    """Write the requested file, or serve the page; print what is said of the scene."""
    if options.plot is None:
        return _serve(scene, options, path, said)
    if options.plot.suffix.lower() == ".png":
        page, ratio = size
        scene.save_png(options.plot, page, pixel_ratio=ratio)
    elif path is None:
        scene.save_html(options.plot)
    else:
        scene.record(*path).save(options.plot)
    print(*said, options.plot, sep="\n")
    return 0


def _serve(scene: Scene | ChainScene, options: argparse.Namespace, path: _Path | None, said: list[str]) -> int:
    with closing(scene), suppress(KeyboardInterrupt):
        print(f"{scene.serve(options.port)} (Ctrl-C ends it)", *said, sep="\n", flush=True)
        if options.open:
            webbrowser.open(scene.url)
        if path is not None:
            scene.play(*path)
        threading.Event().wait()
    return 0


def _angles(option: str, text: str, side: str) -> Rotation:
    flexion, abduction, internal = triple(option, text)
    return shoulder_rotation(flexion, abduction, internal, side=side, degrees=True)


def _path(start: Rotation, end: Rotation, seconds: float) -> _Path:
    """The shortest turn from one pose to another, at an even pace."""
    end_time = duration("--seconds", seconds)
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
