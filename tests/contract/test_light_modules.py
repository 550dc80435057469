"""Modules that Snakemake imports while it parses are light; other modules import at their top.

Every process of the workflow parses the Snakefile, so a heavy import there costs each job a second.
"""

import ast
from pathlib import Path

import pytest

from tools.measure_code import modules

ROOT = Path(__file__).resolve().parents[2]
#: Packages that take long to import.
HEAVY = {
    "h5netcdf",
    "h5py",
    "matplotlib",
    "numba",
    "onnx",
    "pandas",
    "rich",
    "scipy",
    "sklearn",
    "skops",
    "sounddevice",
    "soundfile",
    "torch",
    "umap",
    "xarray",
}
#: Modules that the Snakefile imports, with all that these import, except `ajgdata.types`. Add a
#: module only if parsing needs it; a module of this list imports only light modules.
LIGHT = {
    "acquire",
    "acquire.recipe",
    "evaluate",
    "evaluate.agreement",
    "experiments",
    "experiments.built_in",
    "experiments.division",
    "experiments.registry",
    "experiments.requests",
    "experiments.settings",
    "experiments.spec",
    "gripper",
    "gripper.grippers",
    "gripper.object_library",
    "gripper.objects",
    "gripper.scene",
    "gripper.signal_settings",
    "gripper.variation",
    "paths",
    "pipeline",
    "pipeline.opening_subject",
    "pipeline.outdated",
    "pipeline.plan",
    "pipeline.planned_grasps",
    "pipeline.processes",
    "pipeline.run_changes",
    "pipeline.run_end",
    "pipeline.studies",
    "report",
    "report.comparison",
    "report.format",
    "report.navigation",
    "store",
    "store.changes",
    "store.code_hash",
    "store.file_times",
    "store.files",
    "store.freshness",
    "store.provenance",
    "store.report_files",
    "store.sessions",
    "store.syntax",
    "store.tables",
    "store.variants",
}
#: Packages that are only imported inside functions, because few calls need them: torch, umap and
#: matplotlib take seconds, sounddevice needs PortAudio, and av and huggingface_hub are optional.
LATE = {"av", "huggingface_hub", "onnxruntime", "torch", "umap", "matplotlib", "sounddevice"}
#: Parts of the package that import inside functions, with the reason.
LATE_PARTS = {
    "cli": "`ajgdata --help` must answer at once, and each command needs other modules",
    "export": "the packages of the extra `export` are optional",
    "loading": "`import ajgdata` must stay light",
    "paths": "pooch is only needed for downloads",
}
#: Imports that stay inside functions, because modules that must be light or fast import the module.
STAY = {
    # Snakemake parses recipes without numba
    "ajgdata.gripper.variation": {"ajgdata.gripper.random_fields"},
    # experiments import the module, and most of them need no simulation and no numba
    "ajgdata.pipeline.recipes": {"ajgdata.pipeline.savings"},
    # half a second, and few recordings are resampled
    "ajgdata.store.audio": {"scipy.signal"},
    # an optional package, which tables of text do not need
    "ajgdata.store.imported_table": {"pyarrow", "pyarrow.parquet"},
    # half a second, and processes that compute features or import recordings open no such file
    "ajgdata.store.features": {"xarray"},
    # the command line imports the names of columns
    "ajgdata.store.metrics": {"pandas"},
    # two seconds, and most callers only read descriptions of models
    "ajgdata.store.models": {"skops.io"},
}


def parsed_imports() -> str:
    """Return the imports of the package at the top of the Snakefile. The rules import nothing."""
    top, _, rest = (
        (ROOT / "workflow/Snakefile").read_text(encoding="utf-8").partition("min_version(")
    )
    rules = (ROOT / "workflow/rules").glob("*.smk")
    for text in (rest, *(file.read_text(encoding="utf-8") for file in rules)):
        assert "\nfrom ajgdata" not in text
    statements = ast.parse(top).body
    return "\n".join(ast.unparse(node) for node in statements if "ajgdata" in ast.unparse(node))


def loaded_by(run_python, code: str) -> set[str]:
    """Return the modules that a fresh interpreter has after `code`."""
    return set(run_python(f"{code}\nimport sys\nprint(*sys.modules)").split())


def roots(modules: set[str]) -> set[str]:
    """Return the packages of modules."""
    return {module.partition(".")[0] for module in modules}


def test_what_snakemake_parses_is_light(run_python):
    loaded = loaded_by(run_python, parsed_imports())
    assert roots(loaded) & HEAVY == set()
    own = {name.removeprefix("ajgdata.") for name in loaded if name.startswith("ajgdata.")}
    assert {name for name in own if name.partition(".")[0] != "types"} == LIGHT


def test_the_command_line_starts_light(run_python):
    loaded = roots(loaded_by(run_python, "import ajgdata.cli"))
    assert loaded & (HEAVY | {"numpy", "pooch", "requests"}) == {"rich"}


TREES = modules()


def imported_modules(node: ast.AST) -> list[str]:
    """Return the modules that an import statement names; none for other statements."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module:
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        return [name if name in TREES else node.module for name in names]
    return []


def late_modules() -> set[str]:
    """Return the modules of the package whose import at the top loads one of LATE."""
    top = {
        name: {module for node in tree.body for module in imported_modules(node)}
        for name, tree in TREES.items()
    }
    late: set[str] = set()
    while True:
        added = {
            name
            for name, modules in top.items()
            if name not in late and (modules & late or roots(modules) & LATE)
        }
        if not added:
            return late
        late |= added


LATE_MODULES = late_modules()


def early_imports_inside_functions(name: str) -> list[str]:
    """Return the imports inside the functions of a module that could stand at its top."""
    early = []
    for function in ast.walk(TREES[name]):
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef)):
            for node in ast.walk(function):
                modules = set(imported_modules(node)) - STAY.get(name, set())
                if modules and not (modules & LATE_MODULES or roots(modules) & LATE):
                    early.append(ast.unparse(node))
    return early


def part_of(name: str) -> str:
    """Return the part of the package that a module is in; "" for the package itself."""
    return name.partition(".")[2].partition(".")[0]


@pytest.mark.parametrize("name", [name for name in TREES if part_of(name) not in LATE_PARTS])
def test_only_imports_of_late_packages_are_inside_functions(name):
    assert early_imports_inside_functions(name) == []


@pytest.mark.parametrize("part", sorted(LATE_PARTS))
def test_each_part_that_is_excepted_needs_it(part):
    modules = [name for name in TREES if part_of(name) == part]
    assert any(early_imports_inside_functions(name) for name in modules)
