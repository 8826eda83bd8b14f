"""Style rules of game files that a program can check; CONTRIBUTING explains them."""

import ast
from collections import Counter, defaultdict

import pytest

import ocjax
from tests.support.states import ROOT

COLUMNS = 100  # of a line at most
FUNCTION = 25  # lines of a function at most
NESTED = 2  # `where` inside `where` at most
CUSTOMARY = ("Box", "Game", "Rom")  # classes beside `box`, which makes one, `GAME` and `ROM`
FILES = sorted((ROOT / "extractors").rglob("*.py"))


def pytest_generate_tests(metafunc):
    """Every test with the argument `path` runs on every file, or on those of `--game`."""
    if "path" in metafunc.fixturenames:
        names = metafunc.config.getoption("--game")
        modules = {ocjax.load(name).name.lower() for name in names or ()}
        files = [file for file in FILES if not names or _place(file).parts[0] in modules]
        metafunc.parametrize("path", files, ids=lambda path: _place(path).as_posix())


def _place(path):
    """The path in extractors/, with the name of a game's module as its first part."""
    inside = path.relative_to(ROOT / "extractors")
    return inside.with_suffix("") if len(inside.parts) == 1 else inside


@pytest.fixture
def tree(path):
    return ast.parse(path.read_text())


def test_columns(path):
    lines = path.read_text().splitlines()
    assert not [i for i, line in enumerate(lines, 1) if len(line) > COLUMNS]


def test_imports(tree):
    """One statement imports the names of ocjax, all of them from `ocjax.authoring`.

    The modules of a game may import each other.
    """
    modules = Counter(
        module
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for module in _modules(node)
        if module.split(".")[0] == "ocjax" and not module.startswith("ocjax.extractors.")
    )
    assert modules in ({}, {"ocjax.authoring": 1})


def _modules(node):
    """The absolute names of the modules in an import statement."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [] if node.level else [node.module]


def test_functions_are_short(tree):
    """`decode` is exempt: it is one call a category."""
    long = {
        f.name: _lines(f)
        for f in ast.walk(tree)
        if isinstance(f, ast.FunctionDef) and f.name != "decode" and _lines(f) > FUNCTION
    }
    assert not long


def _lines(function):
    """The lines of a function without its docstring."""
    docstring = ast.get_docstring(function) is not None and function.body[0]
    return (
        function.end_lineno
        - function.lineno
        + 1
        - (docstring.end_lineno - docstring.lineno + 1 if docstring else 0)
    )


def test_one_name_a_statement(tree):
    """A statement binds several names only to the results of a call or the entries of an array."""
    assert not [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple | ast.List)
        and isinstance(node.value, ast.Tuple | ast.List | ast.GeneratorExp | ast.ListComp)
    ]


def test_nothing_is_bound_twice(tree):
    """The rule holds in the module and in each function, including its parameters."""
    assert not _bound_twice(tree.body)
    twice = {
        function.name: _bound_twice(ast.walk(function), _parameters(function))
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
    }
    assert not {name: names for name, names in twice.items() if names}


def _bound_twice(statements, parameters=()):
    """The names that statements bind again or change."""
    bound = Counter(parameters)
    for node in statements:
        if isinstance(node, ast.Assign):
            bound.update(name for target in node.targets for name in _target_names(target))
        elif isinstance(node, ast.AugAssign | ast.AnnAssign):
            bound.update(_target_names(node.target))
    return [name for name, times in bound.items() if times > 1 and name != "_"]


def _parameters(function):
    return [node.arg for node in ast.walk(function.args) if isinstance(node, ast.arg)]


def _target_names(target):
    """The names in a target; `table[0] = 1` changes `table`."""
    if isinstance(target, ast.Name):
        return [target.id]
    if isinstance(target, ast.Tuple | ast.List):
        return [name for entry in target.elts for name in _target_names(entry)]
    if isinstance(target, ast.Starred | ast.Subscript):
        return _target_names(target.value)
    return []


def test_a_name_means_one_thing(tree):
    """Two names never differ by case or underscores alone, and a local never has the name of a
    constant or a function.

    A local may have the name of a class: `state` is a `State`.
    """
    ours, classes, local = (
        _by_letters(_of_module(tree)),
        _by_letters(_classes(tree)),
        _by_letters(_locals(tree)),
    )
    clashes = [
        ours[letters] | classes[letters] | local[letters]
        for letters in {*ours, *classes, *local}
        if len(ours[letters] | classes[letters]) > 1
        or len(local[letters]) > 1
        or (ours[letters] and local[letters])
    ]
    assert not clashes


def _by_letters(names):
    """Names by their lower-case letters, without underscores."""
    groups = defaultdict(set)
    for name in names - {"_"}:
        groups[name.replace("_", "").lower()].add(name)
    return groups


def _imported(tree):
    return {
        (a.asname or a.name).split(".")[0]
        for n in tree.body
        if isinstance(n, ast.Import | ast.ImportFrom)
        for a in n.names
    }


def _is_class(name):
    """True if an imported name belongs to a class."""
    return name[0].isupper() and not name.isupper()


def _classes(tree):
    own = {n.name for n in tree.body if isinstance(n, ast.ClassDef)}
    return (own | set(filter(_is_class, _imported(tree)))) - set(CUSTOMARY)


def _of_module(tree):
    """Constants, functions, and imported names except classes."""
    functions = {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}
    targets = (target for n in tree.body if isinstance(n, ast.Assign) for target in n.targets)
    return functions | _stored(*targets) | {name for name in _imported(tree) if not _is_class(name)}


def _locals(tree):
    """Parameters and local names of functions."""
    functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.Lambda)]
    inner = (n for f in functions for n in ast.walk(f) if n is not f)
    return (
        _stored(*functions)
        | {n.arg for f in functions for n in ast.walk(f.args) if isinstance(n, ast.arg)}
        | {n.name for n in inner if isinstance(n, ast.FunctionDef)}
    )


def _stored(*nodes):
    return {
        n.id
        for node in nodes
        for n in ast.walk(node)
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    }


def test_conditions_stand_in_one_direction(tree):
    """`where` nests at most twice, and no series of `where` overwrites the same name."""
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        assert max((_depth(n) for n in ast.walk(function)), default=0) <= NESTED, function.name
        overwritten = Counter(n.targets[0].id for n in ast.walk(function) if _overwrites(n))
        assert not [name for name, times in overwritten.items() if times > 1], function.name


def _is_where(node):
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "where"
        and len(node.args) == 3
    )


def _depth(node):
    """The depth of nested calls of `where`."""
    return (1 + max((_depth(a) for a in node.args), default=0)) if _is_where(node) else 0


def _overwrites(node):
    """True for a statement `name = where(condition, value, name)`."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and _is_where(node.value)
        and isinstance(node.value.args[2], ast.Name)
        and node.value.args[2].id == node.targets[0].id
    )
