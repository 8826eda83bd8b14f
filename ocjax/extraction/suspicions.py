"""Warnings about frames that are probably not the emulator's frames of the game."""

import warnings

import numpy as np

from ocjax.console import palette
from ocjax.extraction.declaration import Declaration

STACK_LEVEL = 4  # the caller of `Game.vem`


def warn_about_colors(frames: np.ndarray, game: Declaration) -> None:
    """Warn if the console does not draw some of the colours.

    Args:
        frames: uint8 `[..., H, 160]` of palette indices, or uint8 `[..., H, 160, 3]` of RGB.
    """
    if frames.shape[-2:] == game.screen:
        # Only PAL consoles have odd palette indices.
        foreign = (frames & 1).astype(bool) & (game.palette is not palette.PAL)
        kind = "palette indices"
    else:
        foreign = ~np.asarray(palette.is_color(frames, game.palette))
        kind = "colours"
    if foreign.any():
        warnings.warn(
            f"{game.name}: {foreign.mean():.1%} of the pixels have {kind} that the console does "
            "not draw. VEM needs the emulator's own frames in RGB or as palette indices, not "
            "grey, max-pooled, resized or compressed ones.",
            stacklevel=STACK_LEVEL,
        )


def warn_about_nothing(valid: np.ndarray, game: Declaration) -> None:
    """Warn if no object is valid in a batch, bool `[..., N]`."""
    if valid.size and not valid.any():
        warnings.warn(
            f"{game.name}: VEM found no objects. Are these frames of another game, or of a blank "
            "screen?",
            stacklevel=STACK_LEVEL,
        )
