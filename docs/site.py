"""Hooks of MkDocs: pages made from the README, the benchmarks, the games and the modules.

    mkdocs build --strict  # with the extra `docs`

`python docs/picture.py` draws the pictures of the games.
"""

import functools
import inspect
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

import ocjax
from ocjax.cli.description import describe
from ocjax.cli.games import FIGURES
from ocjax.emulators.settings import PRESETS
from ocjax.emulators.start import action_set, load_emulator
from ocjax.envs import Vector
from ocjax.extraction.game import Game
from ocjax.extraction.suites import SUITES
from ocjax.transforms.drawing import category_colors

ROOT = Path(__file__).parent.parent
PAGES = {
    "README.md": "index.md",
    "benchmarks/README.md": "benchmarks.md",
    ".github/CONTRIBUTING.md": "contributing.md",
}
SEARCH = """
<input id="search" type="search" placeholder="Name of a game" aria-label="Name of a game">
<select id="suite" aria-label="Suite"><option value="">all games</option>OPTIONS</select>
<script>
  addEventListener("input", () => {
    const name = document.getElementById("search").value.toLowerCase();
    const suite = document.getElementById("suite").value;
    for (const game of document.querySelectorAll(".game")) {
      const names = `${game.dataset.id} ${game.textContent}`.toLowerCase();
      const isNamed = names.includes(name);
      const isMember = !suite || game.dataset.suites.split(" ").includes(suite);
      game.hidden = !(isNamed && isMember);
    }
  });
</script>
"""
ANIMATION = "<pre>&lt;IPython.core.display.Image object&gt;</pre>"  # in the page of a notebook
LABEL = re.compile(r"^([A-Z][A-Za-z ]*):")  # of a paragraph in the docstring of a game
LINK = re.compile(r"\]\((?!https?:)([^)#]+)(#[^)]*)?\)")
PUBLIC = (
    "ocjax",
    "ocjax.envs",
    "ocjax.recordings",
    "ocjax.files",
    "ocjax.files.atari_head",
    "ocjax.datasets",
    "ocjax.evaluation",
    "ocjax.evaluation.parity",
    "ocjax.ocatari",
    "ocjax.sb3",
    "ocjax.atariari",
    "ocjax.jaxatari",
    "ocjax.layouts",
    "ocjax.errors",
    "ocjax.authoring",
)
FIRST = ("load", "Game", "Objects", "make_vec", "make", "games")  # of the page of `ocjax`
ENTRIES = {  # of the landing page
    "Extract": ("loops.md", "objects from the RAM or the frames of your own loop or files"),
    "Train": ("agents.md", "agents on objects, with ocjax or another library"),
    "Label": ("datasets.md", "frames for detectors, in COCO, YOLO and other formats"),
    "Migrate": ("neighbours.md", "code for OCAtari, HackAtari, AtariARI and JAXtari"),
}
LANDING = "## Install\n"  # the heading of the README below the entries


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made from other files."""
    texts = {
        target: _relinked((ROOT / source).read_text("utf-8"), Path(source).parent)
        for source, target in PAGES.items()
    }
    texts["index.md"] = texts["index.md"].replace(LANDING, f"{_entries()}\n\n{LANDING}", 1)
    texts["reference/index.md"] = "\n".join(_modules())
    texts |= {f"reference/{module}.md": "\n".join(_reference(module)) for module in PUBLIC}
    games = [ocjax.load(name) for name in ocjax.games()]
    texts["games/index.md"] = "\n".join(_gallery(games))
    texts |= {f"games/{game.name}.md": "\n".join(_page(game)) for game in games}
    for path, text in texts.items():
        files.append(File.generated(config, path, content=text))
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


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Show the animations of a notebook, which the converter replaces by their text."""
    if page.file.src_uri.endswith(".ipynb"):
        notebook = json.loads(Path(page.file.abs_src_path).read_text("utf-8"))
        for picture in _animations(notebook):
            html = html.replace(
                ANIMATION, f'<img alt="animation" src="data:image/gif;base64,{picture}">', 1
            )
    return html


def _animations(notebook: dict[str, Any]) -> Iterator[str]:
    """The GIF outputs of a notebook in base64."""
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            if picture := output.get("data", {}).get("image/gif"):
                yield "".join(picture).replace("\n", "")


def _entries() -> str:
    """Cards with links to the four tasks."""
    cards = (f"- **[{name}]({page})**\n\n    {text}" for name, (page, text) in ENTRIES.items())
    return '<div class="grid cards" markdown>\n\n' + "\n\n".join(cards) + "\n\n</div>"


def _gallery(games: list[Game]) -> Iterator[str]:
    yield (
        f"# Games\n\nAll {len(games)} games work with both methods. Each picture shows the objects "
        "that REM finds in one state.\n"
    )
    yield SEARCH.replace("OPTIONS", "".join(f"<option>{name}</option>" for name in SUITES))
    yield '<div class="games" markdown>\n'
    for game in games:
        suites = " ".join(name for name, suite in SUITES.items() if game.name in suite.games)
        yield (
            f'<a class="game" href="{game.name}/" data-id="{game.name}" data-suites="{suites}">'
            f'<img alt="{game.name}" src="{game.name}.png" loading="lazy">{_title(game)}</a>'
        )
    yield "\n</div>"


def _title(game: Game) -> str:
    """The name on the cartridge."""
    return describe(game)["title"].partition(": ")[0]


def _page(game: Game) -> Iterator[str]:
    about = describe(game)
    title, _, text = about["title"].partition(": ")
    yield f"# {title}\n\n{text[:1].upper()}{text[1:]}\n"
    yield from _environment(game)
    yield f"![Objects that REM finds in {game.name}]({game.name}.png)\n"
    yield "## Objects\n"
    yield "| | category | slots | attributes | meaning |\n|---|---|---|---|---|"
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
    yield from _terrain(game)
    yield "## Accuracy\n\n| figure | % |\n|---|---|"
    yield from (
        f"| {text} | {about['accuracy'][key]:.2f} |"
        for key, text in FIGURES.items()
        if about["accuracy"].get(key) is not None
    )
    yield "\n[How the figures are measured](../benchmarks.md#accuracy-and-speed-by-game).\n"
    notes = (LABEL.sub(r"**\1:**", note) for note in about["notes"])
    yield "## Notes\n\n" + "\n\n".join(notes) + "\n"
    yield from _variants(about)
    yield from _starts(about)
    yield from _play(about)
    yield from _machine(about)


def _terrain(game: Game) -> Iterator[str]:
    """The kinds of terrain, if the game has some."""
    if game.terrain is None:
        return
    yield "## Terrain\n"
    yield "[`game.terrain_of(ram).masks`](../terrain.md) has a mask of each kind.\n"
    yield "| kind | effect | drawn by | category | meaning |\n|---|---|---|---|---|"
    for kind in game.terrain:
        category = f"`{kind.category}`" if kind.category else ""
        yield f"| `{kind.name}` | {kind.effect or ''} | {kind.drawn} | {category} | {kind.doc} |"
    yield ""


def _environment(game: Game) -> Iterator[str]:
    """Three lines of code, and the actions and observations."""
    count = len(Vector().features_of(game))
    meanings = ", ".join(a.name for a in action_set(load_emulator(game), PRESETS["v5"]))
    yield (
        f'```python\nimport ocjax\n\nenvs = ocjax.make_vec("{game.name}", num_envs=64)\n'
        "observations, infos = envs.reset(seed=0)\n```\n"
    )
    yield (
        f"| | |\n|---|---|\n| id | `ocjax/{game.name}-v5` |\n"
        f"| decoder | `{_source(game)}` |\n"
        f"| actions | {meanings} |\n"
        f'| `obs="vector"` | float32 `[{count}]` |\n'
        '| `obs="dqn"` | uint8 `[4, 84, 84]` |\n'
        f'| `obs="pixels"` | uint8 `[{game.screen[0]}, {game.screen[1]}, 3]` |\n'
        f"| slots N | {game.num_slots} |\n"
    )


def _source(game: Game) -> str:
    """The path of the game's file or folder in the repository."""
    file = Path(inspect.getsourcefile(game.decode) or "").resolve()
    path = file.parent if file.name == "__init__.py" else file
    return "/".join(path.parts[path.parts.index("extractors") :])


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
        yield "| name | difference |\n|---|---|"
        yield from (f"| `{name}` | {doc} |" for name, doc in about["variations"].items())
        yield ""


def _starts(about: dict[str, Any]) -> Iterator[str]:
    """Starts in later levels."""
    if about["starts"]:
        yield (
            "## Starts\n\nFor `--start` of [`ocjax dataset`](../datasets.md#later-levels) and "
            "`ocjax train`:\n\n| start | the first state shows |\n|---|---|"
        )
        yield from (f"| `{start}` | {doc} |" for start, doc in about["starts"].items())
        yield ""


def _variants(about: dict[str, Any]) -> Iterator[str]:
    """Modes and difficulties, with their meanings where they are known."""
    yield "## Modes and difficulties\n"
    if all(len(numbers) == 1 for numbers in about["variants"].values()):
        yield "The game has one mode and one difficulty.\n"
        return
    yield "Options of the environments:\n\n| option | number | meaning |\n|---|---|---|"
    for kind, option in (("modes", "game_mode"), ("difficulties", "game_difficulty")):
        meanings = about["meanings"][kind]
        for number in about["variants"][kind]:
            yield f"| `{option}` | {number} | {meanings.get(str(number), '')} |"
    source = about["meanings"]["source"]
    yield f"\nSource: {source}.\n" if source else ""


def _machine(about: dict[str, Any]) -> Iterator[str]:
    """ROM and RAM."""
    height, width = about["screen"]
    yield (
        f"## ROM and RAM\n\nALE's ROM `{about['rom']}`, MD5 `{about['md5']}`, "
        f"{width} x {height} pixels.\n"
    )
    yield "REM reads these bytes:\n\n| field | bytes | read as | meaning |\n|---|---|---|---|"
    yield from (
        f"| `{f['name']}` | {', '.join(f['bytes'])} | {f['read']} | {f['comment']} |"
        for f in about["ram"]
    )


def _modules() -> Iterator[str]:
    """A list of the public modules."""
    yield "# Reference\n\nThese pages are made from the docstrings.\n"
    yield "| module | contents |\n|---|---|"
    for module in PUBLIC:
        yield f"| [`{module}`]({module}.md) | {_first_line(_parsed(module))} |"


def _reference(module: str) -> Iterator[str]:
    """The documented names of a public module."""
    public = _parsed(module)
    names = [name for name in public.exports or () if _is_documented(public[str(name)])]
    first = [name for name in FIRST if name in names]
    yield f"# `{module}`\n\n{_first_line(public)}\n"
    rest = sorted(set(names) - set(first))
    yield from (_entry(module, public[str(name)]) for name in [*first, *rest])


def _entry(module: str, found: Any) -> str:
    """The directive for a name of a public module."""
    name = f"{module}.{found.name}"
    if not _shadow(found):
        return f"::: {name}\n"
    options = f"    options:\n      heading: {name}\n      toc_label: {found.name}\n"
    return f"::: {_definition(found).path}\n{options}"


@functools.cache
def _package() -> Any:
    return griffe.load("ocjax", search_paths=[str(ROOT)], resolve_aliases=True)


def _parsed(module: str) -> Any:
    """A module, read without its dependencies."""
    inside = module.removeprefix("ocjax").removeprefix(".")
    return _package()[inside] if inside else _package()


def _first_line(module: Any) -> str:
    return module.docstring.value.splitlines()[0]


def _shadow(found: Any) -> bool:
    """Whether a name is read as the module that defines the function of the same name."""
    return _target(found).is_module and _target(found).name in _target(found).members


def _definition(found: Any) -> Any:
    target = _target(found)
    return target[target.name] if _shadow(found) else target


def _target(found: Any) -> Any:
    return found.final_target if found.is_alias else found


def _is_documented(found: Any) -> bool:
    """Whether something is a class or function of ocjax with a docstring."""
    target = _definition(found)
    return (target.is_class or target.is_function) and target.has_docstring
