"""Policies for a game that has changed since their training."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.console.boxes import box
from ocjax.extraction.categories import Category
from ocjax.extraction.checks import Checks
from ocjax.play import policies, policy_files
from ocjax.play.policies import PolicyError
from ocjax.play.rollouts import rollout
from ocjax.vision.rules import Blobs

RULE = Blobs((14,), region=(0, 0, 160, 100))
ENVS, STEPS = 2, 300


def rebuilt(game, categories, change=lambda name, found: found, **more):
    """The game with other categories, in any order, and with other boxes."""

    def decode(m):
        return {name: change(name, found) for name, found in game.decode(m).items()} | {
            name: f(m) for name, f in more.items()
        }

    return game.replaced(categories=tuple(sorted(categories, key=lambda c: c.hud)), decode=decode)


def with_category(game):
    """A new first category with objects that are always valid."""
    new = Category("Ghost", RULE, count=3, attributes=("orientation", "value"))
    return rebuilt(
        game,
        (new, *game.categories),
        Ghost=lambda m: box(np.array([30, 80, 120]), 90, 5, 5, value=3, orientation=2),
    )


def with_slots(game):
    """One more slot of each category, with an object."""
    counts = {c.name: c.count for c in game.categories}

    def longer(name, found):
        return jax.tree.map(
            lambda a: jnp.concatenate([jnp.broadcast_to(a, (counts[name],)), jnp.ravel(a)[:1]]),
            found,
        )

    return rebuilt(
        game,
        [
            dataclasses.replace(c, count=c.count + 1, rule=RULE, rgb=(1, 2, 3))
            for c in game.categories
        ],
        longer,
    )


def without_grid(game):
    """No category lies on a grid."""
    return rebuilt(
        game, [dataclasses.replace(c, rule=RULE, rgb=(1, 2, 3)) for c in game.categories]
    )


def with_attributes(game):
    """Every object has an orientation and a value."""
    has = {c.name: c.attributes for c in game.categories}

    def more(name, found):
        new = {"orientation": found.x * 0 + 7, "value": found.x * 0 + 9}
        return dataclasses.replace(
            found, **{a: value for a, value in new.items() if a not in has[name]}
        )

    return rebuilt(
        game,
        [dataclasses.replace(c, attributes=("orientation", "value")) for c in game.categories],
        more,
    )


def with_display(game):
    """The first category belongs to the display."""
    first, *others = game.categories
    return rebuilt(game, [*others, dataclasses.replace(first, hud=True)])


def with_other_names(game):
    """Every category has a new name, and the old one as an alias."""
    names = {c.name: f"New{c.name}" for c in game.categories}
    categories = [
        dataclasses.replace(
            c, name=names[c.name], aliases=(c.name,), needs=(), rule=RULE, rgb=(1, 2, 3)
        )
        for c in game.categories
    ]
    return game.replaced(
        categories=tuple(categories),
        decode=lambda m: {names[name]: found for name, found in game.decode(m).items()},
        checks=Checks(),
    )


CHANGES = {
    "reversed": lambda game: rebuilt(game, game.categories[::-1]),
    **{
        f.__name__: f
        for f in (
            with_category,
            with_slots,
            without_grid,
            with_attributes,
            with_display,
            with_other_names,
        )
    },
}


def actions(path, game, rams):
    """A policy's actions in recorded states, int `[STEPS, ENVS]`."""
    count = policies.read(path, game).num_actions
    act = policies.make_policy(str(path), game, count, ENVS, seed=3)
    return np.array(
        [act(policies.Seen(ram, np.full(ENVS, t % 100 == 0))) for t, ram in enumerate(rams)]
    )


@pytest.fixture(scope="module")
def recorded():
    tapes = {}

    def of(name):
        if name not in tapes:
            tape = rollout(
                ocjax.load(name), ENVS * STEPS, policy="trained", num_envs=ENVS, whole_games=False
            )
            tapes[name] = tape.rams.reshape(ENVS, STEPS, 128).swapaxes(0, 1)
        return tapes[name]

    return of


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", ["Pong", "Breakout", "Skiing"])
def test_a_policy_plays_a_changed_game_as_before(recorded, monkeypatch, name, change):
    path, game, rams = policies.SHIPPED / f"{name}.npz", ocjax.load(name), recorded(name)
    expected = actions(path, game, rams)
    changed = CHANGES[change](game)
    by_hud = {True: changed, False: changed.without_hud()}
    monkeypatch.setattr(policy_files, "load", lambda name, hud=True: by_hud[hud])
    assert np.array_equal(actions(path, changed, rams), expected)
    assert len(np.unique(expected)) > 1


@pytest.mark.parametrize("change", ["with_category", "with_slots"])
def test_a_changed_game_has_other_features_for_new_policies(change):
    """The changes above alter the features of a policy without selected slots."""
    game = ocjax.load("Pong")
    kind = policies.read(policies.SHIPPED / "Pong.npz", game).observation
    assert len(kind.features_of(CHANGES[change](game))) > len(kind.features_of(game))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda c: None if c.name == "Enemy" else c,
            "expected 1 slots of the category 'Enemy', but Pong has only the categories Player",
        ),
        (
            lambda c: None if c.hud or c.name == "Player" else c,
            "category 'Player', but Pong has only the categories Enemy, Ball",
        ),
    ],
)
def test_a_category_that_is_gone(change, message):
    game = ocjax.load("Pong")
    less = game.replaced(
        categories=tuple(c for c in map(change, game.categories) if c is not None), hud=False
    )
    with pytest.raises(PolicyError, match=message):
        policies.read(policies.SHIPPED / "Pong.npz", less.replaced(hud=True))


def test_slots_and_attributes_that_are_gone():
    game = ocjax.load("Breakout")
    fewer = [
        dataclasses.replace(c, count=107, rule=RULE, rgb=(1, 2, 3)) if c.name == "Block" else c
        for c in game.categories
    ]
    with pytest.raises(
        PolicyError,
        match=r"Breakout\.npz: .*expected 108 slots of the category 'Block', but Breakout has 107",
    ):
        policies.read(policies.SHIPPED / "Breakout.npz", rebuilt(game, fewer))
    game = ocjax.load("Skiing")
    plain = [
        dataclasses.replace(c, attributes=("value",) if c.hud else ()) for c in game.categories
    ]
    with pytest.raises(
        PolicyError, match=r"expected the category '.*' with orientation, but Skiing has it without"
    ):
        policies.read(policies.SHIPPED / "Skiing.npz", rebuilt(game, plain))


@pytest.mark.parametrize("path", sorted(policies.SHIPPED.glob("*.npz")), ids=lambda path: path.stem)
def test_policies_that_ship_name_their_slots(path, tmp_path):
    """Rewriting a policy changes no weight."""
    game = ocjax.load(path.stem)
    policies.read(path, game).write(tmp_path / "again.npz")
    with np.load(path) as file, np.load(tmp_path / "again.npz") as again:
        assert file.keys() == again.keys()
        assert all(file[name].tobytes() == again[name].tobytes() for name in file)
        slots = json.loads(str(file["description"]))["slots"]
    expected = [(c.name, c.count, c.hud, c.on_grid) for c in game.categories if not c.hud]
    assert [(s["category"], s["count"], s["hud"], s["on_grid"]) for s in slots] == expected


def described(path, change):
    """The policy of Pong with another description."""
    with np.load(policies.SHIPPED / "Pong.npz") as file:
        arrays = dict(file)
    description = json.loads(str(arrays["description"]))
    change(description)
    np.savez(path, **arrays | {"description": np.array(json.dumps(description))})
    return path


WRONG = {
    "category": [0, None, "", "Nobody", "Enemy", ["Player"], "x" * 100_000, "a\nb"],
    "count": [0, -1, 2, 10**12, 10**40, "1", 1.5, float("nan"), None, True, []],
    "hud": [0, 1, "true", None, []],
    "on_grid": [0, 1, "true", None, []],
    "attributes": [None, "value", ["x"], [0], [[]], {"value": 1}, ["orientation"]],
}


@pytest.mark.parametrize(
    ("field", "value"),
    [(field, value) for field, values in WRONG.items() for value in [..., *values]],
)
def test_fields_of_slots(tmp_path, field, value):
    def change(description):
        entry = description["slots"][0]
        entry.pop(field)
        if value is not ...:
            entry[field] = value

    with pytest.raises(PolicyError, match=r"p\.npz: ") as caught:
        policies.read(described(tmp_path / "p.npz", change), ocjax.load("Pong"))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    "slots", [None, [], {}, "Player", [1], [None], [[]], [{}], 7, [{"category": "Player"}] * 10_000]
)
def test_lists_of_slots(tmp_path, slots):
    with pytest.raises(PolicyError, match=r"p\.npz: "):
        policies.read(
            described(tmp_path / "p.npz", lambda description: description.update(slots=slots)),
            ocjax.load("Pong"),
        )


def test_files_without_slots(tmp_path, recorded):
    """Older files see the slots of the game."""
    path = described(tmp_path / "p.npz", lambda description: description.pop("slots"))
    game, rams = ocjax.load("Pong"), recorded("Pong")
    assert np.array_equal(
        actions(path, game, rams), actions(policies.SHIPPED / "Pong.npz", game, rams)
    )
