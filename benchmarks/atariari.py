"""The objects of AtariARI beside ocjax's, in a table of benchmarks/README.md.

    python benchmarks/atariari.py [GAME ...]          update the table
    python benchmarks/atariari.py --labels CHECKOUT   write ocjax/atariari.json

CHECKOUT is a checkout of AtariARI's repository. AtariARI's labels with coordinates define its
objects: `enemy_x1` and `enemy_y1` belong to the object `enemy`. The columns are the number of its
labels, its objects with the number of labels per coordinate, its other labels, and the categories
of ocjax with their slots.
"""

import argparse
import json
import re
import runpy
from collections import Counter
from pathlib import Path

from _page import PageTable

import ocjax
from ocjax import atariari

BEGIN, END = "<!-- atariari: python benchmarks/atariari.py -->", "<!-- end of atariari -->"
HEADER = ["game", "labels", "objects of AtariARI", "other labels", "objects of ocjax"]
POSITION = re.compile(r"^(.*?)\d*_(x|y|column)\d*(?:_\d+)?$")
INDEX = re.compile(r"_\d+$")


def write_labels(checkout: Path) -> None:
    """Write the bytes of the labels by game."""
    table = runpy.run_path(str(checkout / "atariari" / "benchmark" / "ram_annotations.py"))[
        "atari_dict"
    ]
    games = {ocjax.load(game).name: labels for game, labels in table.items()}
    lines = ",\n".join(f"{json.dumps(game)}: {json.dumps(games[game])}" for game in sorted(games))
    (Path(ocjax.__file__).parent / "atariari.json").write_text(f"{{\n{lines}\n}}\n")


def counted(numbers: Counter[str]) -> str:
    """Names with their numbers, except for numbers of 1."""
    return ", ".join(name if n == 1 else f"{name} {n}" for name, n in numbers.items())


def located(labels: list[str]) -> tuple[Counter[str], Counter[str]]:
    """Split labels into objects with coordinates, and other labels without their index.

    The objects have the number of labels per coordinate.
    """
    objects: Counter[str] = Counter()
    for axis in ("x", "y", "column"):
        objects |= Counter(
            m[1] for label in labels if (m := POSITION.match(label)) and m[2] == axis
        )
    rest = [label for label in labels if not POSITION.match(label)]
    stems = Counter(INDEX.sub("", label) for label in rest)
    return objects, Counter(
        stem if stems[stem := INDEX.sub("", label)] > 1 else label for label in rest
    )


def row(name: str) -> list[str]:
    """One row of the table."""
    labels = list(atariari.addresses()[name])
    objects, other = located(labels)
    ours = Counter({c.name: c.count for c in ocjax.load(name).categories})
    return [name, str(len(labels)), counted(objects), counted(other), counted(ours)]


def main() -> None:
    """Update the table, or write the labels."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games of AtariARI's paper")
    parser.add_argument("--labels", metavar="CHECKOUT", type=Path, help="only write the labels")
    arguments = parser.parse_args()
    if arguments.labels:
        write_labels(arguments.labels)
    else:
        PageTable(BEGIN, END, HEADER).measure(arguments.games or atariari.games(), row)


if __name__ == "__main__":
    main()
