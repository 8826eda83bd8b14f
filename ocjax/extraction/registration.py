"""Registration of the environments with Gymnasium, under "ocjax/Pong-v5" and so on.

Gymnasium 1.0 removed plugins, so importing ocjax registers these ids. `gymnasium.make("ocjax:ocjax/Pong-v5")` imports ocjax first.
"""

from ocjax.extraction import registry


def register() -> None:
    """Register every game. This imports Gymnasium, but neither ale-py nor the game files."""
    import gymnasium

    for name in registry.names():
        if registry.env_id(name) not in gymnasium.registry:
            gymnasium.register(
                registry.env_id(name),
                "ocjax.envs.make:make",
                vector_entry_point="ocjax.envs.make:make_vec",
                kwargs={"game": name, "preset": "v5"},
            )
