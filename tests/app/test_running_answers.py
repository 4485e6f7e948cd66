"""Answers of what runs beside the page, as stored: its server."""

import contextlib
import re
import signal
import threading
from unittest import mock

import pytest
from answers import changes, each_of

from exo_pin.app import pose_map, serving
from exo_pin.app.asked import Asked

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


ASKED = {each.__name__: each for each in (served,)}


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
