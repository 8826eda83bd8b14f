"""Draw docs/games.png, the objects that REM finds over recorded frames of several games, and docs/variations.png, variations of games.

python docs/picture.py
"""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import ocjax
from ocjax import recordings
from ocjax.emulators.variations import Variation
from ocjax.envs import make, variations
from ocjax.transforms.drawing import overlay, sheet

ROOT = Path(__file__).parent.parent
SAMPLES = {"SpaceInvaders": 12, "MsPacman": 3, "Freeway": 8, "Boxing": 6, "Skiing": 4, "Asterix": 7}
COLUMNS = 3


STEPS, PAIRS, GAP, LINE = 145, 5, 6, 18  # random steps before a picture, pairs in a row, pixels between them and for a name


def main() -> None:
    """Write the pictures."""
    tiles = []
    for name, sample in SAMPLES.items():
        tape = recordings.read(ROOT / "tests" / "data" / f"{name}.npz", name)
        assert tape.screens is not None
        tiles.append(overlay(tape.game, np.asarray(tape.screens[sample]), ocjax.load(name).rem(tape.rams[sample]), scale=2))
    rows = [tiles[i : i + COLUMNS] for i in range(0, len(tiles), COLUMNS)]
    sheet(rows, ["Objects from 128 bytes of RAM"] + [""] * (COLUMNS - 1)).save(ROOT / "docs" / "games.png", optimize=True)
    draw_variations().quantize(64).save(ROOT / "docs" / "variations.png", optimize=True)


def draw_variations() -> Image.Image:
    """Every variation beside the original game, after the same random actions."""
    names = variations.__all__
    width, height = 2 * 160 + GAP, 210 + LINE
    image = Image.new("RGB", (PAIRS * (width + GAP) - GAP, -(-len(names) // PAIRS) * height), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=LINE - 5)
    for i, name in enumerate(names):
        x, y = i % PAIRS * (width + GAP), i // PAIRS * height
        variation = getattr(variations, name)
        draw.text((x, y), f"{variation.game}: {name}", "black", font)
        for k, hook in enumerate((None, variation)):
            image.paste(Image.fromarray(play(variation.game, hook)), (x + 160 * k, y + LINE))
    return image


def play(game: str, hook: Variation | None) -> np.ndarray:
    """The last frame of a game that is played with random actions, uint8 `[H, 160, 3]`, at most 210 rows."""
    env = make(game, mode="raw", obs="pixels", preset="deterministic-v4", full_action_space=True, hook=hook)
    frame, _ = env.reset(seed=0)
    rng = np.random.default_rng(1)
    for _ in range(STEPS):
        frame = env.step(int(rng.integers(18)))[0]
    env.close()
    return frame[:210]


if __name__ == "__main__":
    main()
