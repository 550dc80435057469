"""Imports go one way. Read from the sources, so that an import inside a function counts too."""

import ast
from fnmatch import fnmatch
from pathlib import Path

from ajgdata.store.provenance import LAYERS

PACKAGE = Path(__file__).resolve().parents[2] / "ajgdata"
#: Lower may not import higher; equal rank may not import one another.
RANKS = {
    "paths": 0,
    "types": 0,
    "gripper": 1,
    "store": 2,
    "features": 3,
    "models": 4,
    "embed": 5,
    "evaluate": 6,
    "studies": 6,
    "acquire": 7,
    "report": 7,
    "live": 8,
    "ablations": 9,
    "export": 9,
    "experiments": 9,
    "loading": 9,
    "tutorial": 9,
    "pipeline": 10,
    "cli": 11,
}
#: Packages that use nothing of ours but what is named.
ALLOWED_ONLY = {"gripper": set(), "types": set(), "paths": set(), "models": {"types"}}
HEAVY = {
    "torch",
    "umap",
    "matplotlib",
    "sounddevice",
    "scipy",
    "sklearn",
    "numba",
    "xarray",
    "pandas",
    "onnx",
}


def imports(path: Path) -> set[str]:
    """Dotted names of everything that a module imports, at any depth."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return names


MODULES = sorted(p for p in PACKAGE.rglob("*.py") if p.parent != PACKAGE or p.stem != "__init__")
IMPORTS = {path.relative_to(PACKAGE): imports(path) for path in MODULES}


def test_imports_go_downward():
    wrong = []
    for path, names in IMPORTS.items():
        here = path.with_suffix("").parts[0]
        ours = {name.split(".")[1] for name in names if name.startswith("ajgdata.")} - {here}
        allowed = {part for part in RANKS if RANKS[part] < RANKS[here]}
        allowed &= ALLOWED_ONLY.get(here, allowed)
        wrong += [f"{path} imports {other}" for other in sorted(ours & set(RANKS) - allowed)]
    assert wrong == []


def test_a_layer_hash_contains_all_that_its_files_import():
    simulated = {Path("store/responses.py")}  # features and models do not read it
    for layer, patterns in LAYERS.items():
        files = {file.relative_to(PACKAGE) for glob in patterns for file in PACKAGE.glob(glob)}
        names = {name for file in (files & set(IMPORTS)) - simulated for name in IMPORTS[file]}
        packages = {name.split(".")[1] for name in names if name.startswith("ajgdata.")}
        missing = {
            name
            for name in packages & set(RANKS) - {"paths", "report"}  # no result is drawn
            if not any(fnmatch(f"{name}/x.py", glob.replace("**/", "")) for glob in patterns)
        }
        assert not missing, layer


def test_nobody_knows_snakemake_or_unpickles():
    banned = {"snakemake", "pickle", "joblib", "dill", "cloudpickle"}
    roots = {path: {name.split(".")[0] for name in names} for path, names in IMPORTS.items()}
    assert {str(path): used & banned for path, used in roots.items() if used & banned} == {}


def test_what_snakemake_parses_is_light(run_python):
    """Every process of the workflow imports this; a dry run must not pay for torch."""
    code = (
        "import sys, ajgdata.pipeline.plan, ajgdata.pipeline.studies, ajgdata.paths, ajgdata;"
        "import ajgdata.store.provenance, ajgdata.store.report_files;"
        "import ajgdata.pipeline.experiments;"
        "import ajgdata.ablations;"
        "print(*{name.split('.')[0] for name in sys.modules})"
    )
    assert not set(run_python(code).split()) & HEAVY


def test_the_command_line_starts_light(run_python):
    code = "import sys, ajgdata.cli; print(*{name.split('.')[0] for name in sys.modules})"
    assert not set(run_python(code).split()) & HEAVY
