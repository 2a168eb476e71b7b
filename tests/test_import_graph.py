"""No module imports itself through others: not at the top, not inside a function, not for type checkers alone."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("go1_mtl_gym", "experts", "trainers")
COMPUTED = {"go1_mtl_gym._moved", "go1_mtl_gym.expert", "experts.mpc.solvers.base", "trainers", "trainers.cli.program"}
"""Modules that import what a user names; `trainers` repeats its table under TYPE_CHECKING, where it counts."""

Graph = dict[str, set[str]]


def modules(root: Path = ROOT, packages: tuple[str, ...] = PACKAGES) -> dict[str, Path]:
    """Every module of the packages by its dotted name; a package is the name of its __init__."""
    named = {}
    for package in packages:
        for path in sorted((root / package).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            named[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return named


def imports(source: str, module: str, is_package: bool, known: set[str]) -> set[str]:
    """The known modules that a module imports, anywhere in it.

    ``from a import b`` is an import of a.b if that is a module and of a otherwise: a package's __init__ counts only
    where a name comes from it.
    """
    targets = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            targets |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parents = module.split(".")[: len(module.split(".")) - node.level + is_package]
                base = ".".join([*parents, *filter(None, [node.module])])
            targets |= {name if (name := f"{base}.{alias.name}") in known else base for alias in node.names}
        elif isinstance(node, ast.Call) and called(node) and isinstance(node.args[0], ast.Constant):
            targets.add(str(node.args[0].value))
    return (targets & known) - {module}


def called(node: ast.Call) -> bool:
    """Whether a call imports a module by its name."""
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return name in ("import_module", "__import__") and bool(node.args)


def graph(paths: dict[str, Path]) -> Graph:
    """Which module imports which."""
    known = set(paths)
    return {
        name: imports(path.read_text(encoding="utf-8"), name, path.name == "__init__.py", known)
        for name, path in paths.items()
    }


def circles(edges: Graph) -> list[list[str]]:
    """The strongly connected components of more than one module, sorted (R. Tarjan, 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    out: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(edges[name]):
            if other not in index:
                visit(other)
            if other in stack:
                low[name] = min(low[name], low[other])
        if low[name] == index[name]:
            component = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(component) > 1:
                out.append(sorted(component))

    for name in sorted(edges):
        if name not in index:
            visit(name)
    return out


@pytest.mark.parametrize("package", PACKAGES)
def test_there_is_no_circle(package):
    edges = graph(modules())
    assert sum(map(len, edges.values())) > 100, "the scan sees the imports"
    assert [circle for circle in circles(edges) if any(name.partition(".")[0] == package for name in circle)] == []


LAYERS = ("utils", "data", "policies", "evaluation", "algorithms", "pipeline", "cli")
"""Sub-packages of `trainers`: each may import those before it."""


def layers(module: str) -> set[str]:
    """Which sub-packages of `trainers` a module may import from: its own and those below."""
    own = module.split(".")[1]
    if own == "play":
        return {*LAYERS[: LAYERS.index("evaluation") + 1], "play"}
    return {*LAYERS[: LAYERS.index(own) + 1]} | ({"play"} if own == "cli" else set())


def test_sub_packages_of_trainers_import_in_their_order():
    inside = {name: others for name, others in graph(modules()).items() if name.count(".") > 1}
    inside = {name: others for name, others in inside.items() if name.startswith("trainers.")}
    assert {name.split(".")[1] for name in inside} == {*LAYERS, "play"}
    wrong = {
        name: bad
        for name, others in inside.items()
        if (bad := {each for each in others if each.startswith("trainers.") and each.split(".")[1] not in layers(name)})
    }
    assert not wrong


def test_imports_by_computed_names_are_the_known_ones():
    """They are invisible here, so each one must be looked at by a person once."""
    computed = set()
    for name, path in modules().items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and called(node) and not isinstance(node.args[0], ast.Constant):
                computed.add(name)
    assert computed == COMPUTED


def written(root: Path, **sources: str) -> dict[str, Path]:
    """A package `p` with an empty __init__ and these modules."""
    (root / "p").mkdir()
    for name, source in {"__init__": "", **sources}.items():
        (root / "p" / f"{name}.py").write_text(source)
    return modules(root, ("p",))


@pytest.mark.parametrize(
    "back",
    [
        "import p.a",
        "from p import a",
        "from p.a import x",
        "from . import a",
        "from .a import x",
        "def f():\n    from p.a import x",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from p.a import x",
        "from importlib import import_module\ndef f():\n    return import_module('p.a')",
    ],
)
def test_the_scan_sees_a_circle_however_it_is_closed(tmp_path, back):
    assert circles(graph(written(tmp_path, a="from p import b\nx = 1", b=back))) == [["p.a", "p.b"]]


def test_a_longer_circle_is_one_and_a_chain_or_a_diamond_is_none(tmp_path):
    chain = {"a": "import p.b, p.c", "b": "import p.d", "c": "import p.d", "d": ""}
    assert circles(graph(written(tmp_path, **chain))) == []
    (tmp_path / "p" / "d.py").write_text("def f():\n    import p.a")
    assert circles(graph(modules(tmp_path, ("p",)))) == [["p.a", "p.b", "p.c", "p.d"]]


def test_an_init_counts_where_a_name_comes_from_it(tmp_path):
    paths = written(tmp_path, __init__="from p.a import x", a="from p import b\nx = 1", b="")
    assert circles(graph(paths)) == [], "p.b is a module: nothing comes from the __init__"
    paths["p.b"].write_text("from p import x")
    assert circles(graph(paths)) == [["p", "p.a", "p.b"]]
