import subprocess
import sys

import pytest
from ale_py.roms import get_all_rom_ids

import ocjax
from ocjax.extraction.suites import SUITES


def test_spellings():
    pong = ocjax.load("Pong")
    for name in (
        "pong",
        "ALE/Pong-v5",
        "ocjax/Pong-v5",
        "PongNoFrameskip-v4",
        "PongDeterministic-v4",
        "Pong-ram-v4",
        "Pong-v0",
        "PONG",
    ):
        assert ocjax.load(name) is pong


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Q*bert", "Qbert"),
        ("H.E.R.O.", "Hero"),
        ("Ms. Pac-Man", "MsPacman"),
        ("Pac-Man", "Pacman"),
        ("Up'n Down", "UpNDown"),
        ("Yars\u2019 Revenge", "YarsRevenge"),
        ("Pitfall II", "Pitfall2"),
        ("ale_py:ALE/Pong-v5", "Pong"),
        ("ocjax:ocjax/Pong-v5", "Pong"),
        ("ale_py:PongNoFrameskip-v4", "Pong"),
    ],
)
def test_names_on_pages(name, found):
    assert ocjax.load(name).name == found


def test_all_games_by_title():
    """The title of a game's docstring, which is printed on its page."""
    for name in ocjax.games():
        title, _, _ = sys.modules[
            f"ocjax.extractors.{ocjax.load(name).name.lower()}"
        ].__doc__.partition(":")
        assert ocjax.load(title).name == name


def test_all_games_by_rom_name():
    for name in ocjax.games():
        assert ocjax.load(ocjax.load(name).rom).name == name


def test_names_are_those_of_the_games():
    """`games` reads the names from the files' names, and they equal the games' own names."""
    assert tuple(ocjax.load(name).name for name in ocjax.games()) == ocjax.games()


def test_without_hud_is_cached():
    assert ocjax.load("Pong", hud=False) is ocjax.load("pong", hud=False)


def test_unknown_game():
    with pytest.raises(ocjax.errors.UnknownGameError, match="did you mean Pong"):
        ocjax.load("Pung")
    with pytest.raises(ValueError, match=r"there are .*Pong"):
        ocjax.load("Xyzzy")
    with pytest.raises(TypeError, match="must be a string"):
        ocjax.load(3)


def test_extractors_has_one_name():
    """A second copy of the game files under the bare name would have its own registry."""
    run = subprocess.run(
        [sys.executable, "-c", "import extractors"], capture_output=True, text=True, check=False
    )
    assert run.returncode != 0
    assert "ocjax.extractors" in run.stderr or "No module named 'extractors'" in run.stderr


@pytest.mark.slow
def test_scripts_beside_a_folder_named_ocjax(tmp_path):
    """A script in the folder that holds the clone imports the package, not the clone's folder."""
    (tmp_path / "ocjax").mkdir()
    script = tmp_path / "script.py"
    script.write_text("import ocjax; print(ocjax.load('Pong').name)")
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert run.stdout == "Pong\n", f"install ocjax again with pip install -e .: {run.stderr}"


def test_import_is_light():
    """Importing ocjax does not import the packages of environments, except Gymnasium, which
    registers their names."""
    packages = ("ale_py", "envpool", "PIL", "typer", "ocjax.envs", "ocjax.extractors.skiing")
    code = (
        f"import sys, ocjax; ocjax.load('Pong'); print([m for m in {packages} if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_names_are_known_without_jax():
    """`import ocjax` registers the environments and knows the games in a fraction of the time that
    JAX needs."""
    code = (
        "import sys, gymnasium, ocjax; print(ocjax.games()[0], 'ocjax/Pong-v5' in "
        "gymnasium.registry, 'jax' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["Adventure", "True", "False"]


def test_public_modules_are_attributes():
    modules = (
        "agents",
        "atariari",
        "authoring",
        "datasets",
        "envs",
        "errors",
        "evaluation",
        "files",
        "jaxatari",
        "layouts",
        "ocatari",
        "recordings",
    )
    code = f"import ocjax; print([getattr(ocjax, m).__name__ for m in {modules}])"
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == str([f"ocjax.{m}" for m in modules])


def test_suites():
    assert {name: len(suite.games) for name, suite in SUITES.items()} == {
        "atari100k": 26, "atari5": 5, "atari10": 10, "atari57": 57, "ocatari": 62,
    }  # fmt: skip
    for name, suite in SUITES.items():
        assert list(suite.games) == sorted(set(suite.games))
        assert set(ocjax.games(suite=name)) == set(suite.games) & set(ocjax.games())
    assert set(ocjax.games(suite="atari100k")) == set(SUITES["atari100k"].games)
    with pytest.raises(ValueError, match="no suite 'atari99': there are atari100k, atari5"):
        ocjax.games(suite="atari99")


def test_names_of_suites_are_those_of_ale():
    roms = {rom.replace("_", "") for rom in get_all_rom_ids()}
    assert {name.lower() for suite in SUITES.values() for name in suite.games} <= roms


def test_games_of_ale_without_a_decoder():
    with pytest.raises(
        ocjax.errors.UnknownGameError,
        match=r"no game 'ALE/ElevatorAction-v5': ALE has this game, but ocjax does not support it",
    ):
        ocjax.load("ALE/ElevatorAction-v5")
