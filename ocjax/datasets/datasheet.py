"""The datasheet of a dataset: a README.md for people and programs.

Its front matter is for the Hugging Face hub. The key `ocjax` holds the protocol and the results as
JSON.
"""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from ocjax.datasets import labels
from ocjax.datasets.plans import Plan
from ocjax.emulators import ram_starts
from ocjax.emulators.start import action_set, load_emulator
from ocjax.evaluation import tables
from ocjax.evaluation.metrics import Agreement
from ocjax.evaluation.tables import Table
from ocjax.extraction import registry
from ocjax.extraction.game import Game

SCORES = ("precision", "recall", "f1", "mean_iou")
TEMPLATE = """---
pretty_name: {title}
tags: [atari, object-detection, reinforcement-learning]
configs: [{{"config_name": "default", "data_files": "data/*.parquet"}}]
ocjax: {facts}
---

# {title}

States of the Atari 2600 game {game}, with the objects that REM (from RAM) and VEM (from pixels) \
find in them.

{results}
## Protocol

Each seed has an equal share of the states. {instances} instances play them side by side, in parts \
of up to {part} states:
{policies}. {starts}Successive states of an instance form sequences of up to {sequence}
states. A sequence is left out if the F1 of REM against VEM is less than {least_f1}.

{settings}

## Columns

| column | contents |
|---|---|
| `index` | number of the state among all that were played; numbers of states that were left out \
are missing |
| `seed`, `policy`, `instance` | the seed, the policy, and the number of the instance |
| `episode`, `step` | number of the episode of this instance, and of the step in the episode |
| `image`, `previous` | the last emulated frame and the one before, lossless: PNG with the \
emulator's palette indices |
| `ram` | the 128 bytes of RAM |
| `action` | the action that led to this state, as an index into {actions}; -1 in the first state \
of an episode |
| `reward`, `terminated`, `truncated` | of the step that led to this state |
| `lives` | the emulator's lives |
| `rem`, `hud` | objects that REM finds: those in play, and those of the display |
| `vem` | objects that VEM finds on `image`, those of the display included |

An object has a `category`, an `index` within it, the box `x`, `y`, `w`, `h` in pixels, \
`orientation` and `value` where its category has
them, the colour `r`, `g`, `b`, and `hud`, whether it belongs to the display.
"""


def text(
    plan: Plan, shards: Sequence[Mapping[str, Any]], versions: Mapping[str, str], code: str
) -> str:
    """Write the datasheet."""
    game = registry.load(plan.game)
    counts = labels.from_counts([shard["counts"] for shard in shards], game)
    totals = {
        name: sum(shard[name] for shard in shards)
        for name in ("states", "sequences", "sequences_left_out", "states_left_out")
    }
    facts = {
        "plan": dataclasses.asdict(plan),
        "labels": {"versions": dict(versions), "code": code},
        **totals,
        "rows": totals["states"] - totals["states_left_out"],
        "agreement": {
            name: _scores(counts.map(lambda a, i=i: a[i]))
            for i, name in enumerate(c.name for c in game.categories)
        },
    }
    return TEMPLATE.format(
        title=f"{game.name} with objects",
        facts=json.dumps(facts),
        game=game.name,
        results=tables.to_markdown([_totals(facts), _agreement(counts, game)]),
        instances=sum(n for _, n in plan.policies),
        policies=", ".join(f"{n} by the policy `{name}`" for name, n in plan.policies),
        part=f"{plan.shard_states:,}",
        sequence=plan.sequence_states,
        starts=_starts(plan),
        least_f1=plan.least_f1,
        settings=_settings(plan),
        actions=", ".join(f"{i} {name}" for i, name in enumerate(_actions(game, plan))),
    )


def _starts(plan: Plan) -> str:
    if not plan.starts:
        return ""
    values = "; ".join(f"`{ram_starts.describe(start)}`" for start in plan.starts)
    return (
        "After the console's reset, values are written to its RAM, in turn for the instances: "
        f"{values}. "
    )


def _settings(plan: Plan) -> str:
    names: dict[str, list[str]] = {}
    for name, _ in plan.policies:
        listed = ", ".join(
            f"{field} {value}" for field, value in plan.settings_of(name).to_dict().items()
        )
        names.setdefault(listed, []).append(f"`{name}`")
    return "\n".join(
        f"- Settings of the emulators that {', '.join(own)} play: {listed}."
        for listed, own in names.items()
    )


def _actions(game: Game, plan: Plan) -> list[str]:
    return [a.name for a in action_set(load_emulator(game), plan.settings_of(plan.policies[0][0]))]


def _totals(facts: Mapping[str, Any]) -> Table:
    rows = [
        ("played", facts["sequences"], facts["states"]),
        ("left out", facts["sequences_left_out"], facts["states_left_out"]),
        ("in this dataset", facts["sequences"] - facts["sequences_left_out"], facts["rows"]),
    ]
    return Table("Size", ("", "Sequences", "States"), rows)


def _agreement(counts: Agreement, game: Game) -> Table:
    rows = []
    for i, c in enumerate(game.categories):
        s = _scores(counts.map(lambda a, i=i: a[i]))
        rows.append(
            (c.name, s["rem"], s["vem"], *(None if s[n] is None else 100 * s[n] for n in SCORES))
        )
    heading = (
        "Category",
        "Objects (REM)",
        "Objects (VEM)",
        "Precision",
        "Recall",
        "F1",
        "Mean IoU",
    )
    return Table("Agreement of REM with VEM, in percent", heading, rows)


def _scores(counts: Agreement) -> dict[str, Any]:
    scores = {name: float(getattr(counts, name)) for name in SCORES}
    known = {name: None if math.isnan(score) else score for name, score in scores.items()}
    return {"rem": int(counts.left), "vem": int(counts.right), **known}
