"""The environments under gymnasium's names: "ocjax/Pong-v5" and so on, known from `import ocjax` on.

Gymnasium 1.0 gave up its plugins, so it cannot find them before; `gymnasium.make("ocjax:ocjax/Pong-v5")` does the import itself.
"""

from ocjax import registry


def register() -> None:
    """Tell gymnasium of every game. It imports gymnasium, but neither the emulator nor any game."""
    import gymnasium

    for name in registry.names():
        if registry.env_id(name) not in gymnasium.registry:
            gymnasium.register(
                registry.env_id(name),
                "ocjax.envs.make:make",
                vector_entry_point="ocjax.envs.make:make_vec",
                kwargs={"game": name, "preset": "v5"},
            )
