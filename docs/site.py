"""Hooks of MkDocs: pages made from the README, the benchmarks, the games and the modules.

    mkdocs build --strict  # with the extra `docs`

Pictures show recorded states in tests/data, so neither ROMs nor ale-py are needed.
"""

import importlib
import inspect
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

import ocjax
from ocjax import recordings
from ocjax.cli.description import describe
from ocjax.cli.gallery import richest
from ocjax.cli.games import FIGURES
from ocjax.extraction.game import Game
from ocjax.transforms.drawing import category_colors, overlay

ROOT = Path(__file__).parent.parent
PAGES = {
    "README.md": "index.md",
    "benchmarks/README.md": "benchmarks.md",
    ".github/CONTRIBUTING.md": "contributing.md",
}
LINK = re.compile(r"\]\((?!https?:)([^)#]+)(#[^)]*)?\)")
PUBLIC = (
    *(
        "ocjax",
        "ocjax.envs",
        "ocjax.recordings",
        "ocjax.files",
        "ocjax.files.atari_head",
        "ocjax.datasets",
        "ocjax.errors",
        "ocjax.authoring",
    ),
    *("ocjax.evaluation", "ocjax.evaluation.parity", "ocjax.ocatari", "ocjax.jaxatari"),
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made from other files."""
    texts = {
        target: _relinked((ROOT / source).read_text("utf-8"), Path(source).parent)
        for source, target in PAGES.items()
    }
    texts["reference.md"] = "\n".join(_reference())
    games = [ocjax.load(name) for name in ocjax.games()]
    texts["games/index.md"] = "\n".join(_gallery(games))
    texts |= {f"games/{game.name}.md": "\n".join(_page(game)) for game in games}
    for path, text in texts.items():
        files.append(File.generated(config, path, content=text))
    for game in games:
        files.append(File.generated(config, f"games/{game.name}.png", content=_picture(game)))
    return files


def _relinked(text: str, folder: Path) -> str:
    """A page with links from the top of `docs/` instead of from its folder."""

    def replace(match: re.Match[str]) -> str:
        target = (ROOT / folder / match[1]).resolve().relative_to(ROOT).as_posix()
        return f"]({PAGES.get(target, target.removeprefix('docs/'))}{match[2] or ''})"

    return LINK.sub(replace, text)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of the guides to files outside of `docs/`."""
    return markdown if page.file.generated_by else _relinked(markdown, Path("docs"))


def _gallery(games: list[Game]) -> Iterator[str]:
    yield (
        f"# Games\n\nAll {len(games)} games work with both methods. Each picture shows the objects "
        "that REM finds in one state.\n"
    )
    yield '<div class="grid cards" markdown>\n'
    for game in games:
        page = f"({game.name}.md)"
        yield f"- [![{game.name}]({game.name}.png)]{page}\n\n    [{game.name}]{page}\n"
    yield "</div>"


def _page(game: Game) -> Iterator[str]:
    about = describe(game)
    yield f"# {game.name}\n\n{about['title'].removeprefix(game.name + ':').strip().capitalize()}\n"
    yield f"![Objects that REM finds in {game.name}]({game.name}.png)\n"
    yield "## Objects\n"
    yield "| | category | slots | attributes | what it is |\n|---|---|---|---|---|"
    colors = category_colors(game)
    for c in about["categories"]:
        first, end = c["slots"]
        attributes = ", ".join(
            name for name in ("hud", "value", "orientation", "blinks") if c[name]
        )
        names = " or ".join(f"`{name}`" for name in (c["name"], *c["aliases"]))
        dot = f'<span style="color: rgb{colors[c["name"]]}">■</span>'
        slots = str(first) if end - first == 1 else f"{first}-{end - 1}"
        yield f"| {dot} | {names} | {slots} | {attributes} | {c['doc']} |"
    yield "\nThe coloured squares are the colours of the boxes in the picture."
    yield "Objects in dashed boxes exist, but the game does not draw them on this frame.\n"
    yield "## Accuracy\n\n| figure | % |\n|---|---|"
    yield from (
        f"| {text} | {about['accuracy'][key]:.2f} |"
        for key, text in FIGURES.items()
        if about["accuracy"].get(key) is not None
    )
    yield "\n[How the figures are measured](../benchmarks.md#accuracy-and-speed-by-game).\n"
    yield "## Notes\n\n" + "\n\n".join(about["notes"]) + "\n"
    yield from _play(about)
    yield from _machine(about)


def _play(about: dict[str, Any]) -> Iterator[str]:
    """The agent that ships with ocjax, and the variations."""
    if about["agent"]:
        yield (
            f"## Agent\n\n`ocjax play {about['name']}` plays with the [agent](../agents.md) that "
            "ships with ocjax.\n"
        )
    if about["variations"]:
        yield (
            "## Variations\n\nFor `hook=` of the environments, and for "
            f"`ocjax play {about['name']} --variations`:\n"
        )
        yield "| name | what is different |\n|---|---|"
        yield from (f"| `{name}` | {doc} |" for name, doc in about["variations"].items())
        yield ""


def _machine(about: dict[str, Any]) -> Iterator[str]:
    """Modes, ROM and RAM."""
    height, width = about["screen"]
    yield (
        f"## ROM and RAM\n\nALE's ROM `{about['rom']}`, MD5 `{about['md5']}`, "
        f"{width} x {height} pixels.\n"
    )
    modes, difficulties = (
        ", ".join(map(str, about["variants"][name])) for name in ("modes", "difficulties")
    )
    if modes:
        yield f"Modes {modes}; difficulties {difficulties}.\n"
    yield "REM reads these bytes:\n\n| field | bytes | read as | meaning |\n|---|---|---|---|"
    yield from (
        f"| `{f['name']}` | {', '.join(f['bytes'])} | {f['read']} | {f['comment']} |"
        for f in about["ram"]
    )


def _picture(game: Game) -> bytes:
    """A PNG of the recorded state in which most kinds of objects are on the screen."""
    tape = recordings.read(ROOT / "tests" / "data" / f"{game.name}.npz", game.name)
    assert tape.screens is not None
    objects = game.rem(np.asarray(tape.rams))
    at = int(richest(game, objects, np.asarray(tape.screens), 1)[0])
    image = overlay(
        game,
        np.asarray(tape.screens[at]),
        jax.tree.map(lambda field: np.asarray(field[at]), objects),
        scale=2,
    )
    out = io.BytesIO()
    image.quantize(64).save(out, "PNG", optimize=True)
    return out.getvalue()


def _reference() -> Iterator[str]:
    """The documented names of the public modules."""
    yield "# Reference\n\nEverything here is generated from the docstrings."
    for module in PUBLIC:
        public = importlib.import_module(module)
        names = [
            name
            for name in getattr(public, "__all__", vars(public))
            if _is_documented(getattr(public, name), module)
        ]
        yield f"\n# `{module}`\n\n{(inspect.getdoc(public) or '').splitlines()[0]}\n"
        yield from (f"::: {getattr(public, name).__module__}.{name}\n" for name in names)


def _is_documented(found: Any, module: str) -> bool:
    """Whether something is a class or function of a module's own."""
    return (
        (inspect.isclass(found) or inspect.isfunction(found))
        and found.__module__.startswith("ocjax")
        and bool(found.__doc__)
    )
