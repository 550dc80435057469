"""environment.yml, pyproject.toml, requirements.lock and the docs name the same packages."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions, version
from pathlib import Path

import yaml

from tools.environment import CPU_INDEX, direct, environment

ROOT = Path(__file__).resolve().parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
PLUGIN = tomllib.loads((ROOT / "workflow/logger/pyproject.toml").read_text())["project"]
LOCK = (ROOT / "requirements.lock").read_text()
EXTRAS = PROJECT["optional-dependencies"]
GROUPS = PYPROJECT["dependency-groups"]


def name_of(requirement: str) -> str:
    return re.split(r"[^A-Za-z0-9._-]", requirement)[0].lower()


def locked() -> dict[str, str]:
    return dict(re.findall(r"^([A-Za-z0-9._-]+)==([^ ;\n]+)", LOCK, flags=re.M))


def test_environment_file_is_what_its_maker_writes():
    assert environment(PYPROJECT, LOCK) == (ROOT / "environment.yml").read_text()


def test_environment_file_works_in_any_folder():
    """Snakemake and users copy it."""
    content = yaml.safe_load((ROOT / "environment.yml").read_text())
    *conda, pip = content["dependencies"]
    assert conda == ["python >=3.11", "pip"]
    index, *pins = pip["pip"]
    assert index == f"--extra-index-url {CPU_INDEX}"
    assert [pin for pin in pins if not re.fullmatch(r"[a-z0-9-]+==[\w.]+", pin)] == []
    assert {"snakemake", "torch", "numba", "sounddevice"} <= {pin.split("=")[0] for pin in pins}


def test_installed_versions_are_the_locked_ones():
    names = direct(PYPROJECT)
    installed = {name: version(name).split("+")[0] for name in names}
    assert installed == {name: locked()[name] for name in names}


def test_every_package_is_locked_and_explained():
    listed = [PROJECT["dependencies"], *EXTRAS.values(), *GROUPS.values()]
    names = {name_of(requirement) for requirements in listed for requirement in requirements}
    names -= {"ajgdata"}  # an extra may name other extras
    assert names - set(locked()) == set()
    page = (ROOT / "docs/dependencies.md").read_text().lower()
    assert [name for name in names if name not in page] == []


def test_bounds_are_tested_and_stated_once():
    """`make test-lowest` tests the project, its extras and its tests."""
    tested = [*PROJECT["dependencies"], *GROUPS["test"]]
    for requirements in EXTRAS.values():
        tested += [text for text in requirements if not text.startswith("ajgdata[")]
    assert [text for text in tested if ">=" not in text] == []
    pairs = {tuple(text.split(">=")) for text in tested}
    lowest = dict(pairs)
    assert len(lowest) == len(pairs)  # a package of two extras has one bound
    assert f'min_version("{lowest["snakemake"]}")' in (ROOT / "workflow/Snakefile").read_text()
    assert f"rich>={lowest['rich']}" in PLUGIN["dependencies"]


def test_make_knows_only_groups_that_exist():
    made = set(re.findall(r"\$\(VENV\)/\.(\w+)", (ROOT / "Makefile").read_text()))
    assert made <= set(GROUPS)


def imported(folder: str) -> dict[str, str]:
    """Modules that the sources in `folder` import when they run, and a file of each; without the
    standard library."""
    modules = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        tree = ast.parse(path.read_text())
        for_types = {
            inner
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
            for inner in ast.walk(node)
        }
        for node in set(ast.walk(tree)) - for_types:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module]
            modules |= {name.partition(".")[0]: str(path.relative_to(ROOT)) for name in names}
    own = {"ajgdata", *sys.stdlib_module_names}
    return {name: path for name, path in modules.items() if name not in own}


def test_every_imported_package_is_declared():
    """A package that only another one brings along may be gone with its next version."""
    distributions = packages_distributions()
    groups = [PROJECT["dependencies"], PLUGIN["dependencies"], *EXTRAS.values(), *GROUPS.values()]
    declared = {name_of(requirement) for group in groups for requirement in group}
    modules = imported("ajgdata") | imported("workflow")
    assert {"requests", "markupsafe", "numpy", "yaml"} <= set(modules)
    for module, path in modules.items():
        names = {name.lower().replace("_", "-") for name in distributions.get(module, [module])}
        assert names & declared, f"{path} imports {module}: declare it in pyproject.toml"
