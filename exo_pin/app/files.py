"""Files of the page: a design to load and to save, and the report; each lives in a temporary folder of its page."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from ..core.errors import InvalidInput
from ..core.files.atomic import write_bytes
from .asked import Asked

#: Largest body of a request, bytes: a long recording.
LARGEST = 20_000_000
#: Largest design file, bytes.
LARGEST_DESIGN = 1_000_000


class PageFiles:
    """What a page was given and what it gives; all is gone when the page is closed."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="exo_pin_app_")

    def close(self) -> None:
        """Remove all files."""
        self._folder.cleanup()

    def _place(self) -> Path:
        """A new folder."""
        return Path(tempfile.mkdtemp(dir=self._folder.name))

    def keep(self, name: str, content: bytes, endings: tuple[str, ...] = (".toml",), most: int = LARGEST) -> str:
        """Path of a file that was given, which is written under its own name within the folder."""
        own = Path(name.replace("\\", "/")).name
        if not own.lower().endswith(endings) or own.startswith("."):
            raise InvalidInput(f"expected a {' or '.join(endings)} file, got {own!r}")
        if len(content) > most:
            raise InvalidInput(f"expected at most {most:,} bytes, got {len(content):,}")
        path = self._place() / own
        write_bytes(path, content)
        return str(path)

    def design(self, asked: Asked) -> tuple[str, bytes]:
        """Name and content of the design as a file; of one that takes several, of an archive of them."""
        folder, name = self._place(), _plain(asked.exo.device.name)
        asked.bare.save(folder / f"{name}.toml")
        written = sorted(folder.iterdir())
        if len(written) == 1:
            return written[0].name, written[0].read_bytes()
        return f"{name}.zip", Path(shutil.make_archive(str(folder), "zip", folder)).read_bytes()

    def report(self, asked: Asked, ending: str) -> tuple[str, bytes]:
        """Name and content of the report on device and person, ``.pdf`` or ``.html``."""
        path = self._place() / f"{_plain(asked.exo.device.name)}-report{ending}"
        given = Path(asked.design)
        asked.exo.report(asked.person, file=given if given.is_file() and not asked.changes else None).save(path)
        return path.name, path.read_bytes()


def _plain(name: str) -> str:
    """A device's name without what a file system may not take."""
    kept = "".join(sign if sign.isalnum() or sign in "-_" else "-" for sign in name)
    return kept.strip("-")[:60] or "device"
