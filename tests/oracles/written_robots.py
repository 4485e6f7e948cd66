"""The text of the file that a chain is written to."""

import tempfile

from exo_pin.chain import read_closures


def text_of(chain, kind, *q):
    with tempfile.TemporaryDirectory() as folder:
        return getattr(chain, f"to_{kind}")(folder, *q).read_text(encoding="utf-8")


def urdf_of(chain):
    """With the closures of the file beside it."""
    with tempfile.TemporaryDirectory() as folder:
        path = chain.to_urdf(folder)
        return path.read_text(encoding="utf-8"), read_closures(path.with_suffix(".closures.toml"))
