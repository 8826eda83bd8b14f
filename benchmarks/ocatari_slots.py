"""Write `ocjax/ocatari_slots.json`, OCAtari's slots of each game, which `ocjax.layouts` uses.

    python benchmarks/ocatari_slots.py PYTHON

PYTHON is an interpreter that has OCAtari. The file has a line for each game: the number of slots of each category outside the display,
in OCAtari's order, and of each display category. Games for which OCAtari declares none, or only those of another game, are missing.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import ocjax

PROGRAM = """
import importlib, json, sys
slots = {}
for game in json.loads(sys.argv[1]):
    module = importlib.import_module("ocatari.ram." + game.lower())
    plain, both = (getattr(module, name, None) for name in ("MAX_NB_OBJECTS", "MAX_NB_OBJECTS_HUD"))
    if plain and both:
        initial = [type(o).__name__ for o in module._init_objects_ram(True)]
        extra = sorted((c for c in both if c not in plain), key=lambda c: initial.index(c) if c in initial else len(initial))
        slots[game] = {"objects": plain, "hud": {c: both[c] for c in extra}}
print(json.dumps(slots))
"""


def main() -> None:
    """Write the file."""
    command = [sys.argv[1], "-c", PROGRAM, json.dumps(ocjax.games())]
    environment = {**os.environ, "PYTHONHASHSEED": "0"}  # some of the tables are made from sets
    run = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    slots = {game: s for game, s in json.loads(run.stdout.splitlines()[-1]).items() if ocjax.load(game).slices.keys() & s["objects"].keys()}
    lines = ",\n".join(f"{json.dumps(game)}: {json.dumps(slots[game])}" for game in sorted(slots))
    (Path(ocjax.__file__).parent / "ocatari_slots.json").write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    main()
