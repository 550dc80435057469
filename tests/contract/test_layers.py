"""Imports go one way. Read from the sources, so that an import inside a function counts too."""

import ast
from collections.abc import Iterable
from pathlib import Path

import pytest

from ajgdata.experiments.registry import EXPERIMENTS, measuring_half
from ajgdata.store.code_hash import CODE, CodeSource, imported_names, sources
from ajgdata.store.syntax import deciding_tree, defined_names, used_statements

PACKAGE = Path(__file__).resolve().parents[2] / "ajgdata"
#: Files that decide no result: names of files, reading and writing of text, identity of inputs,
#: messages, checks of settings, which are parameters of a job.
NEUTRAL = {
    "paths.py",
    "pipeline/processes.py",
    "pipeline/progress.py",
    "store/code_hash.py",
    "store/freshness.py",
    "store/provenance.py",
    "types/extras.py",
}
#: Functions that read and write files of any content, except `numbered_rows` and `plain_text`.
READING_AND_WRITING = {
    "store/files.py:check_yaml_format",
    "store/files.py:copy",
    "store/files.py:csv_bytes",
    "store/files.py:json_bytes",
    "store/files.py:line_of",
    "store/files.py:read_csv",
    "store/files.py:read_json",
    "store/files.py:read_model",
    "store/files.py:read_text",
    "store/files.py:read_yaml",
    "store/files.py:replacing",
    "store/files.py:replacing_folder",
    "store/files.py:sha256_of",
    "store/files.py:write_bytes",
    "store/files.py:write_if_changed",
    "store/files.py:yaml_bytes",
    "store/lock.py:locked",
    "store/sessions.py:check_session_format",
    "store/sessions.py:list_sessions",
    "store/sessions.py:read_dataset",
    "types/formats.py:FEATURES_FORMAT",
    "types/formats.py:LATENTS_FORMAT",
    "types/formats.py:SESSION_FORMAT",
    "types/formats.py:TABLES_FORMAT",
}
#: Definitions that decide no result: names of types and parameters, and texts for people.
TEXTS_AND_TYPES = {
    "experiments/base.py:Experiment",
    "types/errors.py:DataError",
    "types/base.py:Distinct",
    "types/names.py:ModelName",
    "types/names.py:Name",
    "types/errors.py:NotPossibleError",
    "types/base.py:Strict",
    "types/base.py:checked",
    "types/base.py:describe",
    "types/base.py:location",
    "acquire/robot.py:Robot",
    "acquire/sound_card.py:SoundCard",
    "experiments/registry.py:load_experiment",
    "experiments/requests.py:measurement_name",
    "report/format.py:Score",
    "report/format.py:column_title",
    "report/format.py:number",
    "report/format.py:words",
    "types/dataset.py:DatasetSpec",
    # settings are parameters of a job
    "types/features.py:AnyFeature",
    "types/features.py:feature_settings",
    "types/registry.py:Kind",
    "types/settings.py:Microphone",
    "types/settings.py:microphone_text",
    "types/tasks.py:CROSS_VALIDATION",
    # names of columns that are fixed by the format of the files
    "types/session.py:PLACEMENT_COLUMN",
    "types/session.py:SESSION_COLUMN",
}
#: Definitions that jobs of a type import, but that do not decide their results.
NOT_USED = {
    # only experiments on recordings, with copies, or on rendered sounds, call these
    "experiment": {
        "pipeline/copies.py:copy_maker",
        "pipeline/recipes.py:grasp_simulator",
        "pipeline/recipes.py:renderer",
        "pipeline/recordings.py:RecordingReader",
    },
    "experiment on recordings": {
        "pipeline/copies.py:copy_maker",
        "pipeline/recipes.py:grasp_simulator",
        "pipeline/recipes.py:renderer",
    },
    "experiment with copies": {
        "pipeline/recipes.py:grasp_simulator",
        "pipeline/recipes.py:renderer",
    },
    "experiment on rendered sounds": {"pipeline/copies.py:copy_maker"},
    "train": {"pipeline/copies.py:RecordingCopies", "pipeline/copies.py:copy_maker"},
    # the experiments and the data sets are those of the finished measurements
    "collect": {
        "experiments/registry.py:EXPERIMENTS",
        "experiments/spec.py:ExperimentSpec",
        "types/augment.py:Augment",
        "types/registry.py:model_label",
    },
    # its recipes and hypotheses are parameters; savings are a line on the console
    "acquire": {
        "pipeline/savings.py:measured_savings",
        "store/sessions.py:check_one_source",
    },
    # the recording is an input; the model and the data set are named
    "opening": {
        "types/registry.py:model_label",
        "report/report_data.py:Illustration",
        "store/sessions.py:inside",
        "store/sessions.py:read_session",
    },
    # the sessions and the templates are parameters; the report has its own links and counts
    "publish": {
        "acquire/recipe.py:session_names",
        "report/navigation.py:Group",
        "report/navigation.py:groups_on",
        "report/navigation.py:link_from_report",
        "store/report_files.py:template_folders",
        "store/sessions.py:dropped_sessions",
        "types/issues.py:IssueCounts",
        "types/issues.py:issue_counts",
    },
}
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
    "export": 9,
    "experiments": 9,
    "loading": 9,
    "tutorial": 9,
    "pages": 10,
    "pipeline": 11,
    "browse": 12,
    "cli": 13,
}
#: Packages that use nothing of ours but what is named.
ALLOWED_ONLY = {"gripper": set(), "types": set(), "paths": set(), "models": {"types"}}


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


def decided_elsewhere(job_type: str, file: str, name: str) -> bool:
    """Whether a file that the code of a job imports does not decide its result."""
    definition = f"{file}:{name}"
    neutral = TEXTS_AND_TYPES | READING_AND_WRITING | NOT_USED.get(job_type, set())
    return file in NEUTRAL or definition in neutral


def imports_of_job(job_type: str) -> set[str]:
    """Return all definitions that the code of a type of job imports."""
    halves = [measuring_half(n) for n, e in EXPERIMENTS.items() if e.job_type == job_type]
    return {
        f"{CodeSource(file).place}:{name}"
        for source in (*sources(job_type), *(source for half in halves for source in half))
        if source.file.suffix == ".py"
        for file, name in imported_definitions(source)
    }


def imported_definitions(source: CodeSource) -> set[tuple[Path, str]]:
    """Return file and name of what a source imports."""
    return {
        defined_in(file, name) for file, name in imported_names(source.file, source.statements())
    }


def missing_sources(job_type: str, listed: Iterable[CodeSource]) -> set[str]:
    """Return the definitions that listed sources import, and that none of them contains."""
    own = [source for source in listed if source.file.suffix == ".py"]
    contained = {
        (source.file, name)
        for source in own
        for statement in source.statements()
        for name in defined_names(statement)
    }
    whole = {source.file for source in own if not source.names}
    imported = set().union(*(imported_definitions(source) for source in own))
    places = {
        (CodeSource(file).place, name) for file, name in imported - contained if file not in whole
    }
    return {
        f"{file}:{name}" for file, name in places if not decided_elsewhere(job_type, file, name)
    }


def defined_in(file: Path, name: str) -> tuple[Path, str]:
    """Return the file that defines an imported name: `types/__init__.py` only passes names on."""
    if file == PACKAGE / "types/__init__.py":
        for origin, passed_on in imported_names(file, deciding_tree(file).body):
            if passed_on == name:
                return origin, name
    return file, name


@pytest.mark.parametrize("job_type", CODE)
def test_the_sources_of_a_job_include_all_that_they_import(job_type):
    assert missing_sources(job_type, sources(job_type)) == set()


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_sources_of_an_experiment_include_all_that_it_measures_with(name):
    job_type = EXPERIMENTS[name].job_type
    assert missing_sources(job_type, [*sources(job_type), *measuring_half(name)]) == set()


@pytest.mark.parametrize("job_type", CODE)
def test_each_listed_source_exists(job_type):
    for listed in CODE[job_type]:
        pattern, _, names = listed.partition(":")
        (*files,) = PACKAGE.glob(pattern)
        assert files, listed
        for name in filter(None, names.split(",")):
            assert used_statements(deciding_tree(files[0]), (name,)), listed


def test_each_exception_is_needed():
    used = set().union(*(imports_of_job(job_type) for job_type in CODE))
    assert {name.partition(":")[0] for name in used} >= NEUTRAL
    assert used >= TEXTS_AND_TYPES | READING_AND_WRITING
    for job_type, names in NOT_USED.items():
        assert imports_of_job(job_type) >= names


def test_nobody_knows_snakemake_or_unpickles():
    banned = {"snakemake", "pickle", "joblib", "dill", "cloudpickle"}
    roots = {path: {name.split(".")[0] for name in names} for path, names in IMPORTS.items()}
    assert {str(path): used & banned for path, used in roots.items() if used & banned} == {}
