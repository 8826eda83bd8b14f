"""How game files are written, as far as a program can check it; CONTRIBUTING says why."""

import ast
from collections import Counter

import pytest

from tests.support.states import ROOT

LINES, COLUMNS = 400, 100  # of a file at most
FUNCTION = 25  # lines of a function at most
NESTED = 2  # `where` inside `where` at most
FILES = sorted((ROOT / "extractors").rglob("*.py"))


@pytest.fixture(params=FILES, ids=lambda path: path.relative_to(ROOT / "extractors").as_posix())
def path(request):
    return request.param


@pytest.fixture
def tree(path):
    return ast.parse(path.read_text())


def test_size(path):
    lines = path.read_text().splitlines()
    assert len(lines) <= LINES
    assert not [i for i, line in enumerate(lines, 1) if len(line) > COLUMNS]


def test_functions_are_short(tree):
    """But for `decode`, which is one call a category."""
    long = {f.name: _lines(f) for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) and f.name != "decode" and _lines(f) > FUNCTION}
    assert not long


def _lines(function):
    """The lines of a function without those of its docstring."""
    docstring = ast.get_docstring(function) is not None and function.body[0]
    return function.end_lineno - function.lineno + 1 - (docstring.end_lineno - docstring.lineno + 1 if docstring else 0)


def test_one_name_a_statement(tree):
    assignments = [n for n in tree.body if isinstance(n, ast.Assign)]
    assert not [n.lineno for n in assignments if isinstance(n.value, ast.Tuple) and isinstance(n.targets[0], ast.Tuple)]


def test_nothing_is_bound_twice(tree):
    bound = Counter(
        name.id
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        for name in ast.walk(target)
        if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)
    )
    assert not [name for name, times in bound.items() if times > 1]


def test_conditions_stand_in_one_direction(tree):
    """No `where` inside `where` inside `where`, and no name that one `where` after the other overwrites."""
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        assert max((_depth(n) for n in ast.walk(function)), default=0) <= NESTED, function.name
        overwritten = Counter(n.targets[0].id for n in ast.walk(function) if _overwrites(n))
        assert not [name for name, times in overwritten.items() if times > 1], function.name


def _is_where(node):
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "where" and len(node.args) == 3


def _depth(node):
    """How many calls of `where` are inside each other."""
    return (1 + max((_depth(a) for a in node.args), default=0)) if _is_where(node) else 0


def _overwrites(node):
    """Whether a statement is `name = where(condition, value, name)`."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and _is_where(node.value)
        and isinstance(node.value.args[2], ast.Name)
        and node.value.args[2].id == node.targets[0].id
    )
