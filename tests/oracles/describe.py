"""Descriptions of pictures: what differs from the stored ones, a picture to look at, and how to store anew.

    python tests/oracles/describe.py pose human           draws both into files to look at, and prints what differs
    python tests/oracles/describe.py pose human --store   stores them as they are now, once you have looked at them
    python tests/oracles/describe.py --store              all of them

In ``tests/view/described`` there is a file for each picture. One whose name begins with that of another, as
``wrist_offset`` with ``wrist``, has only what differs from it.
"""

import argparse
import json
from functools import cache
from pathlib import Path

import matplotlib as mpl
from described_figures import figure_description
from described_scenes import film_description, scene_description
from descriptions import differences, written
from drawn_figures import FIGURES
from drawn_scenes import FILMS, PERSONS, SCENES
from matplotlib import pyplot

mpl.use("agg")
FOLDER = Path(__file__).parents[1] / "view" / "described"
NAMES = (*FIGURES, *SCENES, *PERSONS, *FILMS)


@cache
def drawn(name):
    """A picture and its whole description."""
    for pictures, describe in ((FIGURES, figure_description), (FILMS, film_description)):
        if name in pictures:
            picture = pictures[name]()
            return picture, json.loads(written(describe(picture)))
    scene = (SCENES | PERSONS)[name]()
    return scene, json.loads(written(scene_description(scene)))


def description(name):
    """What is stored of a picture."""
    found, base = drawn(name)[1], name.partition("_")[0]
    if base == name or base not in NAMES or name in FIGURES:
        return found
    other = drawn(base)[1]
    gone = [part for part in other if part not in found]
    return {part: value for part, value in found.items() if value != other.get(part)} | {"gone": gone}


def changes(name):
    """What differs from what is stored, a line each."""
    file = FOLDER / f"{name}.json"
    stored = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    return list(differences(stored, description(name)))


def main():
    """Draw pictures, print what differs, and store it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", help="of pictures; all if left out")
    parser.add_argument("--store", action="store_true", help="store them as they are now")
    parser.add_argument("--to", type=Path, default=Path("pictures"), help="folder of the files to look at")
    options = parser.parse_args()
    options.to.mkdir(exist_ok=True)
    for name in options.names or NAMES:
        print(name, *changes(name), sep="\n    ", flush=True)
        pyplot.close("all")
        if options.store:
            (FOLDER / f"{name}.json").write_text(written(description(name)) + "\n", encoding="utf-8")
        elif name in FIGURES:
            drawn(name)[0].savefig(options.to / f"{name}.png", dpi=110)
        elif name in FILMS:
            drawn(name)[0].save(options.to / f"{name}.html")
        else:
            drawn(name)[0].save_png(options.to / f"{name}.png")


if __name__ == "__main__":
    main()
