"""Run notebooks from top to bottom, each in a fresh kernel: python notebooks/run.py [--store] [NOTEBOOK ...]

Ends with status 1 if a cell fails, if a notebook's stored text is not what it prints now, or if a check of it in
``tests/notebook_checks`` does not hold, and prints how long each took. Needs the extra ``notebooks``. With ``--store``
the outputs are written into the notebooks, as a reader without Python sees them: scenes as pictures, live ones too,
which needs a headless browser and the extra ``test``.
"""

import os
import argparse
import base64
import html
import re
import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError

#: After which a cell counts as hung, s; a whole notebook takes a few.
SECONDS = 600
#: Of a stored scene, pixels.
SIZE = (1000, 620)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


def run(path, store, checks):
    """Why a notebook fails, None if it does not."""
    start = time.monotonic()
    notebook = nbformat.read(path, as_version=4)
    stored = [printed(cell) for cell in notebook.cells]
    check = checks / f"{path.stem}.py"
    if check.is_file():
        # Run last in the notebook's kernel, and no part of the notebook.
        notebook.cells.append(nbformat.v4.new_code_cell(check.read_text(encoding="utf-8")))
    client = NotebookClient(
        notebook,
        timeout=SECONDS,
        kernel_name="python3",
        resources={"metadata": {"path": str(path.parent)}},
        on_cell_executed=show_live if store else None,
    )
    try:
        client.execute()
    except (CellExecutionError, CellTimeoutError) as error:
        return str(error)
    del notebook.cells[len(stored) :]
    if store:
        write(notebook, path)
    else:
        for number, (old, cell) in enumerate(zip(stored, notebook.cells, strict=True)):
            if not same(old, printed(cell)):
                return f"cell {number} prints\n{printed(cell)}\nand is stored with\n{old}\n(run with --store)"
    print(f"{path.name}: {time.monotonic() - start:.1f} s", flush=True)
    return None


def show_live(cell, cell_index, execute_reply):
    """Replace a live page by a picture of it, while the kernel that serves it still runs."""
    for k, output in enumerate(cell.get("outputs", ())):
        frame = re.search(r'<iframe src="(http[^"]*)"', output.get("data", {}).get("text/html", ""))
        if frame is not None:
            cell.outputs[k] = picture(lambda browser, url=html.unescape(frame[1]): browser.open(url))


def picture(opened):
    """The output that a page gives; ``opened`` opens it in a browser."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))
    from browser_window import BrowserWindow

    with BrowserWindow(SIZE) as browser:
        opened(browser)
        browser.evaluate("document.body.classList.add('still')")
        shown = base64.b64encode(browser.screenshot()).decode("ascii")
    return nbformat.v4.new_output("display_data", {"image/png": shown})


def printed(cell):
    """What a cell prints."""
    return "".join(output.text for output in cell.get("outputs", ()) if output.output_type == "stream")


def same(text, other):
    """Whether words are equal and numbers nearly so: the last digits differ from processor to processor."""
    if NUMBER.sub("#", text).split() != NUMBER.sub("#", other).split():
        return False
    pairs = zip(NUMBER.findall(text), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= 0.02 * abs(float(a)) + 0.011 for a, b in pairs)


def write(notebook, path):
    """Write the outputs into the notebook, without what only lives while it runs."""
    notebook.metadata = {"kernelspec": notebook.metadata.kernelspec, "language_info": {"name": "python"}}
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            streams = nbformat.v4.new_output("stream", text=printed(cell))
            shown = [still(output) for output in cell.outputs if output.output_type != "stream"]
            cell.outputs = [streams] * bool(streams.text) + [output for output in shown if output is not None]
    nbformat.validate(notebook)
    nbformat.write(notebook, path)


def still(output):
    """The output as it can be stored: a framed scene as a picture; None for sliders."""
    frame = re.search(r'<iframe srcdoc="([^"]*)"', output.data.get("text/html", ""))
    if frame is not None:
        return picture(lambda browser: browser.open_html(html.unescape(frame[1])))
    lives = "<iframe" in output.data.get("text/html", "") or any("widget" in kind for kind in output.data)
    return None if lives else output


def main():
    # The word that something is being compiled is no output of a notebook.
    os.environ.setdefault("EXO_PIN_COMPILE", "compiled")
    here = Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("notebooks", nargs="*", type=Path, default=sorted(here.glob("*.ipynb")))
    parser.add_argument("--store", action="store_true", help="write outputs into the notebooks")
    parser.add_argument("--checks", type=Path, default=here.parent / "tests/notebook_checks", help="folder of checks")
    options = parser.parse_args()
    failed = 0
    for path in options.notebooks:
        reason = run(path.resolve(), options.store, options.checks)
        if reason is not None:
            failed += 1
            print(f"{path.name}: {reason}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
