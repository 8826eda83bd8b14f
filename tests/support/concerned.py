"""The categories that depend on a line of a game's files, found by reading the files."""

import ast
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import ocjax.extractors

FOLDER = Path(ocjax.extractors.__file__).resolve().parent
MODULE = "<module>"  # the name of a frame outside functions


class _Part(NamedTuple):
    """A statement, or a part of one that belongs to a category."""

    path: Path
    lines: range
    binds: frozenset[str]  # names; a local name has the function's name in front
    uses: frozenset[str]
    category: str = ""


def add_categories(error: BaseException) -> None:
    """Add a note to an error from a game's file: the categories that depend on the failed line."""
    place = _place(error)
    names = [] if place is None else categories_at(*place)
    if names:
        error.add_note(f"This concerns {', '.join(names)}.")


def _place(error: BaseException) -> tuple[Path, int] | None:
    """The failed line in the game's files.

    At the import it is the last line outside functions, else the first line of all.
    """
    frames = [
        (path, number, frame.f_code.co_name)
        for one in _chain(error)
        for frame, number in traceback.walk_tb(one.__traceback__)
        if (path := Path(frame.f_code.co_filename).resolve()).is_relative_to(FOLDER)
    ]
    importing = [frame for frame in frames if frame[2] == MODULE]
    chosen = importing[-1:] or frames[:1]
    return chosen[0][:2] if chosen else None


def _chain(error: BaseException) -> Iterator[BaseException]:
    """An error and its causes: a `GameError` has one."""
    current: BaseException | None = error
    while current is not None:
        yield current
        current = current.__cause__


def categories_at(path: Path, line: int) -> list[str]:
    """The names of the categories that depend on a line of a game's file, sorted."""
    files = [path] if path.parent == FOLDER else sorted(path.parent.glob("*.py"))
    parts = [part for file in files for part in _parts_of_file(file)]
    here = [part for part in parts if part.path == path and line in part.lines]
    shortest = min((len(part.lines) for part in here), default=0)
    found = [part for part in here if len(part.lines) == shortest]
    new = found
    while new:
        bound = {name for part in new for name in part.binds}
        new = [part for part in parts if part not in found and part.uses & bound]
        found = found + new
    return sorted({part.category for part in found if part.category})


def _parts_of_file(path: Path) -> Iterator[_Part]:
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.FunctionDef):
            own = {node.id for node in _names(statement, ast.Store)}
            own |= {node.arg for node in ast.walk(statement.args) if isinstance(node, ast.arg)}
            for inner in statement.body:
                yield from _parts(path, inner, statement.name, own)
        else:
            yield from _parts(path, statement, "", set())


def _parts(path: Path, statement: ast.stmt, function: str, own: set[str]) -> Iterator[_Part]:
    """The statement, and the entries and calls in it that begin with a category's name."""

    def names(node: ast.AST, context: type) -> frozenset[str]:
        return frozenset(
            f"{function}.{name.id}" if name.id in own else name.id for name in _names(node, context)
        )

    def part(node: ast.stmt | ast.expr, category: str = "") -> _Part:
        lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
        return _Part(path, lines, binds, names(node, ast.Load), category)

    binds = names(statement, ast.Store) | _defined(statement, function)
    yield part(statement)
    for node in ast.walk(statement):
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                if _is_name(key):
                    yield part(value, key.value)  # type: ignore
        elif isinstance(node, ast.Call) and node.args and _is_name(node.args[0]):
            yield part(node, node.args[0].value)  # type: ignore


def _defined(statement: ast.stmt, function: str) -> set[str]:
    """The names that a statement defines without an assignment."""
    match statement:
        case ast.ClassDef():
            return {statement.name}
        case ast.Return():
            return {function}
        case ast.ImportFrom():
            return {alias.asname or alias.name for alias in statement.names}
    return set()


def _is_name(node: ast.AST | None) -> bool:
    """True for a string such as a category's name."""
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and node.value[:1].isupper()
        and node.value.isidentifier()
    )


def _names(node: ast.AST, context: type) -> list[ast.Name]:
    return [n for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, context)]
