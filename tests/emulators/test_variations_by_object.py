"""Variations remove, freeze and recolour categories by name."""

import json
from pathlib import Path

import numpy as np
import pytest

import ocjax
from ocjax.emulators import variations
from ocjax.emulators.variations import objects
from ocjax.envs import make
from ocjax.ramtools.control import control
from tests.support.command import run

STEPS = 200
KNOWN = [(game, name) for game in ocjax.games() for name in variations.names(game)]


def seen(game, hook, *, mode="vem", hud=False):
    """The objects in each frame of random play with a frame skip that covers both phases of
    flickering objects."""
    env = make(
        game,
        mode=mode,
        obs="objects",
        frame_skip=3,
        repeat_action_probability=0.0,
        hook=hook,
        hud=hud,
        render_mode="rgb_array",
    )
    env.reset(seed=5)
    rng = np.random.default_rng(5)
    for _ in range(STEPS):
        action = int(rng.integers(int(env.action_space.n)))
        for _ in range(int(rng.integers(1, 9))):
            _, _, terminated, truncated, _ = env.step(action)
            yield env.views(), env.render()
            if terminated or truncated:
                env.reset()
    env.close()


def places(game, hook, category):
    """The places of a category's objects, and the number of frames with any of them."""
    frames = [
        [(o.x, o.y) for o in found if o.category == category] for found, _ in seen(game, hook)
    ]
    return [place for frame in frames for place in frame], sum(map(bool, frames))


def check(game, name):
    """A variation makes its change on the screen, in other play than the play that found it."""
    kind, category = name.split(" ", 1)
    if kind == "recolor":
        name = f"{name} {0x9A}"
        boxes = [
            (frame, o)
            for found, frame in seen(game, f"{game}:{name}", mode="rem")
            for o in found
            if o.category == category
        ]
        drawn = [
            (frame[o.y : o.y + o.h, o.x : o.x + o.w] == ocjax.load(game).palette[0x9A])
            .all(-1)
            .any()
            for frame, o in boxes
        ]
        assert np.mean(drawn) > 0.9
        return
    (before, _), (after, frames) = (
        places(game, None, category),
        places(game, f"{game}:{name}", category),
    )
    assert len(before) > 10
    if kind == "remove":
        assert len(after) <= 0.05 * len(before)
    else:
        _, times = np.unique(after, axis=0, return_counts=True)
        assert times[times >= 0.1 * frames].sum() > 0.85 * times.sum()
        assert len(after) > 0.3 * len(before)


@pytest.mark.parametrize(
    ("title", "name"),
    [("Pong", "remove Enemy"), ("Freeway", "freeze Car"), ("Boxing", "recolor Player")],
)
def test_on_the_screen(title, name):
    assert (title, name) in KNOWN
    check(title, name)


@pytest.mark.slow
@pytest.mark.parametrize(("title", "name"), KNOWN, ids=[f"{game}-{name}" for game, name in KNOWN])
def test_all_on_the_screen(title, name):
    check(title, name)


def test_declarations():
    for game, name in KNOWN:
        spec, (kind, category) = ocjax.load(game), name.split(" ", 1)
        assert category in spec.slices
        found = (
            variations.recolor(game, category, "red")
            if kind == "recolor"
            else getattr(variations, kind)(game, category)
        )
        assert found.game == game
        assert found.writes
        assert found.doc.endswith(".")


def test_names():
    assert variations.find("Pong:remove Enemy") == variations.remove("Pong", "Enemy")
    assert variations.find("recolor Player red", "Boxing") == variations.recolor(
        "Boxing", "Player", objects.COLORS["red"]
    )
    assert variations.find("Boxing:recolor Player 70").writes == {1: 70}
    assert "PlayerScore" in variations.recolor("Boxing", "Player", 70).doc


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Pong:remove Wall", "Pong has no category 'Wall'; it has Player"),
        ("Pong:recolor Ball red", "no bytes are known that recolor Ball; known: .*remove Enemy"),
        (
            "Boxing:recolor Player purple",
            "the colour must be a palette index from 0 to 255, or one of black, .*'purple'",
        ),
        ("Boxing:recolor Player 256", "the colour must be a palette index .* got 256"),
    ],
)
def test_errors(name, message):
    with pytest.raises(ValueError, match=message):
        variations.find(name)


def test_the_documentation_lists_them():
    page = (Path(__file__).parents[2] / "docs" / "neighbours.md").read_text()
    for title in {title for title, _ in KNOWN}:
        assert f"| {title} | {', '.join(f'`{name}`' for name in variations.names(title))} |" in page


@pytest.mark.slow
def test_search():
    found = {(c.kind, c.category): c for c in control(ocjax.load("Pong"))}
    assert found["freeze", "Player"].writes.keys() == {60}
    assert found["freeze", "Ball"].writes.keys() == {49, 54}
    assert ("remove", "Enemy") in found


@pytest.mark.slow
def test_command(tmp_path):
    out = tmp_path / "found.json"
    out.write_text(json.dumps({"Boxing": {}}))
    assert "freeze" in run("ram", "control", "Pong", "--json", out).output
    written = json.loads(out.read_text())
    assert list(written) == ["Boxing", "Pong"]
    assert written["Pong"]["freeze"]["Player"]["bytes"].keys() == {"60"}
