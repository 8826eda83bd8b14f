"""Checks that hold for all objects, and frames for them."""

import jax
import numpy as np

FIELDS = {
    "xywh": (np.int16, (4,)),
    "valid": (np.bool_, ()),
    "orientation": (np.int8, ()),
    "value": (np.int32, ()),
    "rgb": (np.uint8, (3,)),
}


def host(objects):
    return jax.tree.map(np.asarray, objects)


def same(a, b):
    return all(
        np.array_equal(p, q)
        for p, q in zip(jax.tree.leaves(host(a)), jax.tree.leaves(host(b)), strict=True)
    )


def check(game, objects, batch):
    """Objects are well-formed: dtypes and shapes, boxes on the screen, invalid slots zero, only
    declared attributes."""
    o = host(objects)
    height, width = game.screen
    for name, (dtype, tail) in FIELDS.items():
        assert getattr(o, name).dtype == dtype
        assert getattr(o, name).shape == (*batch, game.num_slots, *tail)
        assert not getattr(o, name)[~o.valid].any(), f"{name} of invalid slots"
    x, y, w, h = np.moveaxis(o.xywh.astype(int)[o.valid], -1, 0)
    assert ((x >= 0) & (y >= 0) & (w > 0) & (h > 0) & (x + w <= width) & (y + h <= height)).all()
    assert ((o.orientation >= -1) & (o.orientation < 16)).all()
    for c in game.categories:
        for attribute in {"value", "orientation"} - set(c.attributes):
            assert not getattr(o, attribute)[..., game.slices[c.name]].any()


def random_frames(game, rng, n):
    """Noise of all colours, of the game's own, and blocks of them (large, touching objects).

    A third is noise. It takes a hundred times as long as a frame of a game, because it has
    thousands of components.
    """
    height, width = game.screen
    own = np.array(
        sorted({c for category in game.categories for c in category.rule.palette}), np.uint8
    )
    kinds = rng.choice(3, size=n, p=(1 / 6, 1 / 6, 2 / 3))
    frames = np.empty((n, height, width), np.uint8)
    for i, kind in enumerate(kinds):
        if kind == 0:
            frames[i] = rng.integers(0, 128, (height, width)) * 2
        else:
            size = 1 if kind == 1 else int(rng.integers(2, 40))
            coarse = rng.choice(
                np.append(own, [0] * (2 * len(own))), (height // size + 1, width // size + 1)
            )
            frames[i] = coarse.repeat(size, 0).repeat(size, 1)[:height, :width]
    return frames
