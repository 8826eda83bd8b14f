"""Draw docs/games.gif, the objects of both methods in play, docs/variations.png and docs/games.

    python docs/picture.py [GAME ...]

With names of games, only their pictures in docs/games are drawn: REM's objects in one recorded
state of tests/data.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np
from PIL import Image, ImageDraw, ImageFont

import ocjax
from ocjax import recordings
from ocjax.cli.gallery import richest
from ocjax.envs import variations
from ocjax.extraction.game import Game
from ocjax.play.policies import SHIPPED
from ocjax.play.rollouts import rollout
from ocjax.transforms.drawing import overlay, pixels, sheet

ROOT = Path(__file__).parent.parent
PLAYED = {"MsPacman": 330, "Seaquest": 260}  # frames skipped before
FRAMES = 45  # of the animation, one for each agent step
FRAME_SKIP = 4
FRAME_TIME = 90  # milliseconds
TITLES = ("REM: objects from RAM", "VEM: objects from pixels")


SHOWN = (  # variations
    "Alien:no_alien",
    "Asterix:odd_lines_free",
    "BankHeist:only_police",
    "Boxing:color_player_black",
    "Breakout:color_all_blocks_red",
    "ChopperCommand:color_blue",
    "FishingDerby:fish_in_middle",
    "Freeway:stop_all_cars",
    "Freeway:stopped_cars",
    "Frostbite:reposition_floes_easy",
    "Kangaroo:change_level_1",
    "MsPacman:caged_ghosts",
    "MsPacman:set_level_1",
    "Pong:lazy_enemy",
    "Pong:parallel_enemy",
    "Riverraid:red_river",
    "Skiing:invert_flags",
    "SpaceInvaders:no_shields",
    "SpaceInvaders:relocate_shields_right",
    "Tennis:always_lower_player",
)
STEPS, PAIRS, GAP, LINE = (
    145,
    5,
    6,
    18,
)  # random steps before a picture, pairs in a row, pixels between them and for a name


def main(names: Sequence[str]) -> None:
    """Write the pictures of some games, or all pictures."""
    for name in names or ocjax.games():
        picture = draw_game(ocjax.load(name)).quantize(64)
        picture.save(ROOT / "docs" / "games" / f"{name}.png", optimize=True)
    if not names:
        draw_animations()


def draw_animations() -> None:
    """Write docs/games.gif and docs/variations.png."""
    games = [draw_play(name, after) for name, after in PLAYED.items()]
    sheets = [sheet([pictures[t] for pictures in games], TITLES) for t in range(FRAMES)]
    colors = sheets[0].quantize(64)
    images = [image.quantize(palette=colors, dither=Image.Dither.NONE) for image in sheets]
    animation = {
        "save_all": True,
        "append_images": images[1:],
        "duration": FRAME_TIME,
        "loop": 0,
        "optimize": True,
    }
    images[0].save(ROOT / "docs" / "games.gif", **animation)
    draw_variations().quantize(64).save(ROOT / "docs" / "variations.png", optimize=True)


def draw_play(name: str, after: int) -> list[list[Image.Image]]:
    """REM's beside VEM's objects on each frame.

    The shipped agent plays, or random actions in games without one.
    """
    game = ocjax.load(name)
    policy = "trained" if (SHIPPED / f"{name}.npz").exists() else "repeat"
    tape = rollout(
        game,
        FRAMES,
        policy=policy,
        num_envs=1,
        frame_skip=FRAME_SKIP,
        after=after,
        whole_games=False,
    )
    assert tape.screens is not None
    methods = jax.tree.map(np.asarray, (game.rem(tape.rams), game.vem(tape.screens)))
    return [
        [overlay(game, frame, objects[t], scale=2) for objects in methods]
        for t, frame in enumerate(tape.screens)
    ]


def draw_game(game: Game) -> Image.Image:
    """REM's objects, and their pixels, in the recorded state with most kinds of objects."""
    tape = recordings.read(ROOT / "tests" / "data" / f"{game.name}.npz", game.name)
    screens = np.asarray(tape.screens)
    objects = jax.tree.map(np.asarray, game.rem(np.asarray(tape.rams)))
    at = int(richest(game, objects, screens, 1)[0])
    boxes = overlay(game, screens[at], objects[at], scale=2)
    return sheet([[boxes, pixels(game, screens[at], objects[at], scale=2)]], ())


def draw_variations() -> Image.Image:
    """Variations beside the original game, after the same random actions."""
    width, height = 2 * 160 + GAP, 210 + LINE
    image = Image.new(
        "RGB", (PAIRS * (width + GAP) - GAP, -(-len(SHOWN) // PAIRS) * height), "white"
    )
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=LINE - 5)
    for i, name in enumerate(SHOWN):
        x, y = i % PAIRS * (width + GAP), i // PAIRS * height
        draw.text((x, y), name.replace(":", ": "), "black", font)
        for k, hook in enumerate((None, name)):
            image.paste(
                Image.fromarray(play(variations.ALL[name].game, hook)), (x + 160 * k, y + LINE)
            )
    return image


def play(game: str, hook: str | None) -> np.ndarray:
    """The last frame of random play, uint8 `[H, 160, 3]`, at most 210 rows."""
    env = ocjax.make(
        game, mode="raw", obs="pixels", preset="deterministic-v4", full_action_space=True, hook=hook
    )
    frame, _ = env.reset(seed=0)
    rng = np.random.default_rng(1)
    for _ in range(STEPS):
        frame = env.step(int(rng.integers(int(env.action_space.n))))[0]
    env.close()
    return frame[:210]


if __name__ == "__main__":
    main(sys.argv[1:])
