"""Answers of what runs beside the page, as stored: its server, and the search for a better design."""

import contextlib
import multiprocessing
import re
import signal
import threading
from types import SimpleNamespace
from unittest import mock

import pytest
from answers import changes, each_of

import exo_pin as ep
from exo_pin.app import pose_map, serving
from exo_pin.app.asked import Asked
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


ASKED = {each.__name__: each for each in (served, searched, followed)}


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
