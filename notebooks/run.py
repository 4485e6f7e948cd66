"""Run notebooks from top to bottom, each in a fresh kernel: python notebooks/run.py [NOTEBOOK ...]

Ends with status 1 if a cell fails, and prints how long each notebook took. Needs the extra ``notebooks``.
"""

import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError

#: After which a cell counts as hung, s; a whole notebook takes a few.
SECONDS = 600


def run(path: Path) -> str | None:
    """Why a notebook fails, None if it does not."""
    start = time.monotonic()
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook, timeout=SECONDS, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}}
    )
    try:
        client.execute()
    except (CellExecutionError, CellTimeoutError) as error:
        return str(error)
    print(f"{path.name}: {time.monotonic() - start:.1f} s", flush=True)
    return None


def main() -> int:
    here = Path(__file__).resolve().parent
    paths = [Path(name).resolve() for name in sys.argv[1:]] or sorted(here.glob("*.ipynb"))
    failed = 0
    for path in paths:
        reason = run(path)
        if reason is not None:
            failed += 1
            print(f"{path.name}: {reason}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
