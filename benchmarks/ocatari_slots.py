"""Print OCAtari's slots in the format of ocjax/ocatari_slots.json.

    PYTHON benchmarks/ocatari_slots.py > ocjax/ocatari_slots.json

The slots are the names and numbers of the objects in `OCAtari.objects`. PYTHON is the interpreter
of an environment with OCAtari 2.2.1; see the README of the benchmarks. Games without such tables
are skipped.
"""

import json
import sys

import ocatari.core  # noqa: F401  # loads all games  # pyright: ignore[reportMissingImports]


def main() -> None:
    """Print the tables of all games, each with and without the HUD."""
    modules = {
        name.rsplit(".", 1)[1]: module
        for name, module in sys.modules.items()
        if name.startswith("ocatari.ram.")
    }
    tables = {
        name: {"objects": module.MAX_NB_OBJECTS, "hud": module.MAX_NB_OBJECTS_HUD}
        for name, module in sorted(modules.items())
        if hasattr(module, "MAX_NB_OBJECTS") and hasattr(module, "MAX_NB_OBJECTS_HUD")
    }
    rows = [f'"{name}": {json.dumps(table)}' for name, table in tables.items()]
    print("{\n" + ",\n".join(rows) + "\n}")


if __name__ == "__main__":
    main()
