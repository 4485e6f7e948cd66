"""Answers of what runs beside the page, as stored: its server, and the search for a better design."""

import contextlib
import multiprocessing
import re
import signal
import threading
from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of

import exo_pin as ep
from exo_pin.app import following, pose_map, serving
from exo_pin.app.asked import Asked
from exo_pin.app.following import Shown
from exo_pin.app.searching import Found, Search, look
from exo_pin.core.errors import InvalidInput

CABLES = Asked("four-cables", flexion=20.0)


def served():
    """What the server is given, what is said and opened, and who hears that the page is to end."""
    uvicorn, told = pytest.importorskip("uvicorn", reason="needs the extra app"), []

    def run(server, sockets):
        config, handler = server.config, signal.getsignal(signal.SIGTERM)
        address = f"http://127.0.0.1:{sockets[0].getsockname()[1]}/{config.app[1]}/"
        told.append([address in told[-1], config.log_level, config.lifespan, handler is signal.default_int_handler])
        sockets[0].close()

    def made(asked, token):
        told.append(asked.design)
        return asked, token

    def taken(first, free=serving.free_socket):
        told.append(first)
        return free(0)

    with contextlib.ExitStack() as stack:
        for place, other in (
            ("require_extra", told.append), ("webbrowser.open", told.append), ("warnings.simplefilter", told.append),
            ("end_workers", lambda: told.append("ended")), ("_application", made),
            ("free_socket", taken),
        ):  # fmt: skip
            stack.enter_context(mock.patch(f"exo_pin.app.serving.{place}", other))
        stack.enter_context(mock.patch.object(uvicorn.Server, "run", run))
        before = signal.getsignal(signal.SIGTERM)
        serving.serve_app(CABLES, 0, True, told.append)
        serving.serve_app(said=told.append)
        told.append(signal.getsignal(signal.SIGTERM) is before)
        thread = threading.Thread(target=serving.serve_app, kwargs={"port": 0, "said": told.append})
        thread.start()
        thread.join()
    return re.sub(r":\d+/[\w-]{24}/", "…", repr(told))


def searched():
    """What a look asks of the search, and what it tells of the best design."""
    exo, asked = CABLES.exo, []
    better = ep.ShoulderExo.from_device(exo.device.with_dimensions(cuff_height_mm=212.34))

    def optimise(own, bounds, **options):
        asked.append([own is exo, bounds, options])
        return SimpleNamespace(
            best_candidate=SimpleNamespace(design=SimpleNamespace(device=better.device), index=0.4321),
            start=None if options["budget"] == 48 else SimpleNamespace(index=0.21), evaluations=options["budget"] + 1,
        )  # fmt: skip

    bounds = {"cuff_height_mm": (160.0, 270.0), "A[1].radius_mm": (200.0, 300.0)}
    with mock.patch("exo_pin.app.searching.optimise", optimise):
        return [look(exo, bounds, budget, "a file") for budget in (48, 96)], asked


def followed():
    """What a search tells from its beginning to its end, in processes that are copies of this one."""
    ended, shown = threading.Event(), []

    def show(found):
        shown.append(found)
        if found is None:
            ended.set()

    def told(exo, bounds, budget, storage):
        assert going.wait(60.0)
        if bounds["a"] < budget:
            raise InvalidInput("no such dimension")
        ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        return Found(budget, 0.5, 0.25, {exo.name: bounds["a"], storage.name: ignored})

    fork = multiprocessing.get_context("fork")
    going = fork.Event()
    with (
        mock.patch("exo_pin.app.searching.look", told),
        mock.patch("exo_pin.app.searching.multiprocessing.get_context", return_value=fork),
    ):
        search = Search(show)
        for most in (1000, 100):
            ended.clear()
            going.clear()
            search.start(CABLES.exo, {"a": most})
            working = search.works
            going.set()
            assert ended.wait(60.0)
            shown.append([working, search.works])
        search.stop()
    return shown, [each.words for each in shown if isinstance(each, Found)]


def pictures():
    """What is drawn of one question after the other, in which scene and to which scale, and what is answered."""
    told, done, before = [], threading.Event(), {*threading.enumerate()}

    class Scene:
        def __init__(self, exo, human=True, metres_per_newton=None):
            told.append(["scene", exo.name, human, metres_per_newton])
            self.exo, self.metres_per_newton = exo, {"four-cables": 0.005, "prototype": 0.0005}.get(exo.name, 0.002)

        def replace_exo(self, exo):
            told.append(["another", self.exo.name, exo.name, exo.device.dimensions().get("A[1].radius_m")])
            self.exo = exo

        def show(self, pose, motion=None):
            if pose.magnitude() > 2.0:
                raise ZeroDivisionError
            told.append(["pose", pose, motion is not None])

        def offer(self, joints, hand):
            told.append(["offered", [*joints], hand])

    def answer(asked, moving=False):
        told.append(["asked", asked.name, moving])
        return Shown(asked, moving=moving)

    def show(place, shown):
        if not shown.moving and place == len(asked) - 1:
            done.set()

    other, turned = replace(CABLES, design="prototype"), replace(CABLES, flexion=40.0)
    found = {}
    with (
        mock.patch.object(following, "Scene", Scene), mock.patch.object(following, "answered", answer),
        mock.patch.object(following, "_RESTS", 0.01),
    ):  # fmt: skip
        asked, worker = (), following.Following(show, lambda place, scene: told.append(["new", place, scene.exo.name]))
        for name, asked in {
            "one": (CABLES,), "turned": (turned,), "another": (other,), "none": (replace(CABLES, design="nothing"),),
            "changed": (CABLES.changed("A[1].radius_mm", 260.0),), "heavier": (replace(CABLES, mass=90.0),),
            "joints": (CABLES,), "moving": (replace(CABLES, angular_velocity=(1.0, 0.0, 0.0)),), "two": (CABLES, other),
            "two turned": (turned, other), "two changed": (turned.changed("A[1].radius_mm", 260.0), other),
            "anew": (CABLES, other), "one wrong": (CABLES, replace(CABLES, design="nothing")), "alone": (CABLES,),
            "fault": (replace(CABLES, flexion=140.0),), "after it": (turned,),
        }.items():  # fmt: skip
            if name != "one":
                worker.joints = name in ("joints", "two")
            if name == "anew":
                worker.draw_anew()
            done.clear()
            worker.ask(*asked)
            assert done.wait(60.0)
            found[name], told = told, []
        worker.close(wait=True)
    return found, told, len({*threading.enumerate()} - before)


ASKED = {each.__name__: each for each in (served, searched, followed, pictures)}


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
@each_of(ASKED, ASKED)
def test_an_answer_is_as_stored(name):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])


def test_processes_behind_the_page_end_with_it():
    pose_map.end_workers()
    made = pose_map.workers()
    assert pose_map.workers() is made
    pose_map.end_workers()
    assert not pose_map.workers.cache_info().currsize
    with pytest.raises(RuntimeError, match="shutdown"):
        made.submit(len, "")
