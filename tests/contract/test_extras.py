"""Each part of the package imports only packages that the installation with its extra brings."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

import ajgdata
from ajgdata.types import MODELS
from ajgdata.types.extras import PACKAGES, extras, packages_of
from tools.measure_code import modules, run_time_nodes

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BASE = {re.split(r"[^\w.-]", text)[0] for text in PROJECT["dependencies"]}
TREES = modules()
JOBS = {
    f"ajgdata.pipeline.{match}"
    for file in (ROOT / "workflow/rules").glob("*.smk")
    for match in re.findall(r'function="(\w+):', file.read_text(encoding="utf-8"))
}
#: Modules of jobs that need other extras than `workflow`.
OTHER_JOBS = ("opening", "publish", "recipes", "studies")
#: Modules that work with one extra alone. Without an extra ("") these are the public names, and
#: all commands that are not listed below.
WORKING = {
    "": {
        *ajgdata._MODULES,
        "ajgdata.acquire.sound_card",
        "ajgdata.acquire.virtual",
        "ajgdata.browse.view",
        "ajgdata.cli",
        "ajgdata.evaluate.planning",
        "ajgdata.live.sort",
        "ajgdata.live.terminal",
        "ajgdata.models.baselines",
        "ajgdata.pipeline.accept",
        "ajgdata.pipeline.acquire_live",
        "ajgdata.pipeline.dataset_differences",
        "ajgdata.pipeline.dataset_versions",
        "ajgdata.pipeline.fetch",
        "ajgdata.pipeline.importing",
        "ajgdata.pipeline.label_counts",
        "ajgdata.pipeline.label_issues",
        "ajgdata.pipeline.pilot",
        "ajgdata.pipeline.sort",
        "ajgdata.pipeline.train",
        "ajgdata.pipeline.validate",
        "ajgdata.store.new_project",
        "ajgdata.store.packaged_datasets",
        "ajgdata.tutorial",
    },
    "workflow": JOBS - {f"ajgdata.pipeline.{name}" for name in OTHER_JOBS},
    "cnn": {"ajgdata.embed.encoder", "ajgdata.embed.projections", "ajgdata.models.cnn"},
    "audio": {"ajgdata.store.ffmpeg"},
    "simulate": {
        "ajgdata.gripper.simulation",
        "ajgdata.pipeline.opening",
        "ajgdata.pipeline.recipes",
        "ajgdata.pipeline.savings",
        "ajgdata.pipeline.studies",
        "ajgdata.report.scenes",
        "ajgdata.studies.verification",
    },
    "publish": {
        "ajgdata.pipeline.feature_table",
        "ajgdata.pipeline.publish",
        "ajgdata.pipeline.published_models",
        "ajgdata.pipeline.upload",
    },
    "hub": {"ajgdata.store.remote.hub", "ajgdata.store.remote.origins"},
    "live": {"ajgdata.browse.site", "ajgdata.live.dashboard"},
    "export": {"ajgdata.export"},
}


def imported(node: ast.AST) -> list[str]:
    """Return the modules that an import statement names, with the packages around them."""
    names: list[str] = []
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom) and node.module:
        inner = [f"{node.module}.{alias.name}" for alias in node.names]
        names = [node.module, *(name for name in inner if name in TREES)]
    parts = [name.split(".") for name in names]
    return [".".join(part[:end]) for part in parts for end in range(1, len(part) + 1)]


def all_imports(name: str) -> set[str]:
    """Return the modules that a module of the package imports, also inside functions."""
    return {module for node in run_time_nodes(TREES[name]) for module in imported(node)}


def top_imports(name: str) -> set[str]:
    """Return the modules that the import of a module of the package imports."""
    tree = TREES[name]
    inner = {
        id(node)
        for function in ast.walk(tree)
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef))
        for node in ast.walk(function)
    }
    nodes = [node for node in run_time_nodes(tree) if id(node) not in inner]
    return {module for node in nodes for module in imported(node)}


def foreign_imports(names: set[str]) -> dict[str, str]:
    """Return the foreign packages that modules load, each with a module that imports it.

    These are the imports of `names` also inside functions, and what these imports load.
    """
    foreign = {}
    seen = set()
    remaining = set(names)
    while remaining:
        name = remaining.pop()
        seen.add(name)
        for module in all_imports(name) if name in names else top_imports(name):
            root = module.partition(".")[0]
            if module in TREES:
                remaining |= {module} - seen
            elif root != "ajgdata" and root not in sys.stdlib_module_names:
                foreign[root] = name
    return foreign


def canonical(package: str) -> str:
    """Return the name of a package as pyproject.toml writes it."""
    return package.lower().replace("_", "-")


def distribution(module: str) -> str:
    """Return the package that a message names for a module."""
    return PACKAGES.get(module, module.replace("_", "-"))


def test_the_installed_metadata_lists_the_extras_of_pyproject():
    assert set(PROJECT["optional-dependencies"]) == {*WORKING, "all"} - {""}
    assert set(extras()) == set(PROJECT["optional-dependencies"]), "outdated: run `make env`"
    for extra, texts in PROJECT["optional-dependencies"].items():
        own = {re.split(r"[^\w.-]", text)[0] for text in texts}
        assert own - {"ajgdata"} <= set(packages_of(extra))


def test_all_has_the_packages_of_every_extra():
    every = {package for extra in extras() for package in packages_of(extra)}
    assert set(packages_of("all")) == every
    assert every & BASE == set()


@pytest.mark.parametrize("extra", WORKING)
def test_a_part_imports_only_packages_of_its_extra(extra):
    assert WORKING[extra] <= set(TREES)
    distributions = packages_distributions()
    allowed = BASE | set(packages_of(extra))
    wrong = {
        module: origin
        for module, origin in foreign_imports(WORKING[extra]).items()
        if not {canonical(name) for name in distributions.get(module, [module])} & allowed
    }
    assert wrong == {}


def test_the_package_of_every_optional_import_is_found_by_the_name_of_its_module():
    """Otherwise a missing package would be an error with a traceback."""
    distributions = packages_distributions()
    optional = {package for extra in extras() for package in packages_of(extra)}
    nodes = [node for tree in TREES.values() for node in run_time_nodes(tree)]
    roots = {name.partition(".")[0] for node in nodes for name in imported(node)}
    used = {
        root: {canonical(name) for name in distributions.get(root, [])} & optional for root in roots
    }
    found = {root: packages for root, packages in used.items() if packages}
    assert {root: {distribution(root)} for root in found} == found
    assert {"torch", "umap", "markdown_it", "numba", "sse_starlette"} <= set(found)


@pytest.mark.parametrize("name", MODELS)
def test_a_model_names_the_extra_that_it_needs(name):
    module = MODELS[name].make.partition(":")[0]
    if module in TREES:  # not a model of another package
        packages = {distribution(root) for root in foreign_imports({module})}
        needed = packages & {package for extra in extras() for package in packages_of(extra)}
        assert bool(needed) == bool(MODELS[name].extra)
        assert needed <= set(packages_of(MODELS[name].extra))
