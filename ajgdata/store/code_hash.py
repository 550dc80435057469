"""Hash of the code that decides a result, for each type of job.

A result is computed again if the code that decides it changes. `CODE` names the sources of each
type of job. Comments, docstrings, descriptions of settings and texts inside `raise` do not count.
"""

from __future__ import annotations

import ast
import functools
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path

from ajgdata.paths import PACKAGE
from ajgdata.store.files import read_yaml, sha256_of
from ajgdata.store.syntax import deciding_tree, defined_names, used_statements
from ajgdata.types.extras import installed_version
from ajgdata.types.features import OWN_FEATURES, SHIPPED, FeatureKind, FeatureSettings
from ajgdata.types.registry import MODELS, OWN_MODELS

_SPECTRUM_SETTINGS = ("types/features.py:ALL_HZ,FeatureKind,FeatureSettings,ShortTime",)
#: Session -> its table and files -> samples, issues and spectra.
_RECORDINGS = (
    "features/checks.py",
    "features/compute.py",
    "features/encoding.py",
    "features/gaps.py",
    "features/hum.py",
    "features/offset.py",
    "features/repeats.py",
    "features/segments.py",
    "features/share.py",
    "features/spectrum.py",
    "pipeline/recordings.py",
    "store/audio.py:FileHashes,file_sha256,read_audio",
    "store/changes.py:read_changes,with_changes",
    "store/feature_array.py",
    "store/ffmpeg.py",
    "store/files.py:numbered_rows,plain_text",
    "store/session_audio.py",
    "store/sessions.py:audio_path,read_recordings,read_session",
    "types/change.py",
    *_SPECTRUM_SETTINGS,
    "types/issues.py:Finding,WHOLE",
    "types/names.py:NAME_PATTERN",
    "types/session.py",
    "types/settings.py",
)
#: Spectra -> recordings of the same sound.
_SIMILAR = (
    "acquire/protocol.py:REFERENCE",
    "features/similarity.py",
    "pipeline/similar_sounds.py:leak_refusals,sounds_of,without_equal_sounds",
    "store/features.py:read_store",
    "store/labels.py:copy_finding,take_rows",
    "types/issues.py:Finding,WHOLE",
    "types/session.py:SIMULATED_SOURCES",
)
#: Recordings -> features of other kinds.
_OTHER_FEATURES = (
    "features/embedding.py",
    "features/mel.py",
    "features/spectrogram.py",
    "features/transfer_function.py",
    "types/features.py",
)
#: Scene -> impulse response and recording.
_GRIPPER = ("gripper/*.py",)
#: Recipe -> grasps -> recordings.
_SIMULATED = (
    *_GRIPPER,
    "acquire/card.py",
    "acquire/excitation.py",
    "acquire/recipe.py",
    "acquire/robot.py:Measured,NOTHING_MEASURED",
    "acquire/robot_numbers.py:FORCE",
    "acquire/virtual.py",
    "store/audio.py:file_sha256,inspect_audio,read_audio",
    "store/ffmpeg.py",
    "store/responses.py",
    "store/sessions.py:inside",
    "types/excitation.py",
    "types/recipe.py",
    "types/settings.py:AudioSettings,Level,as_written",
)
_MODELS = ("models/*.py", "types/input_layout.py", "types/registry.py")
#: Features -> recordings of a task.
_TASK = (
    *_MODELS,
    *_SPECTRUM_SETTINGS,
    "evaluate/task_data.py",
    "store/feature_array.py",
    "store/features.py:read_store",
    "types/augment.py",
    "types/settings.py",
    "types/task_settings.py",
    "types/tasks.py",
)
#: Recordings of a task -> features of their changed copies.
_COPIES = (*_RECORDINGS, *_OTHER_FEATURES, "features/augment.py", "pipeline/copies.py")
_TABLES = ("store/tables.py", "types/formats.py:TABLES_FORMAT", "types/table.py")
#: The job of an experiment; `experiments.registry.measuring_half` is added.
_EXPERIMENT = (
    *_TASK,
    *_TABLES,
    *_SIMILAR,
    "experiments/base.py:Inputs,Outcome",
    "features/spectrum.py:differing_axes",
    "pipeline/experiments.py:run_experiment",
    "store/features.py:read_latents",
    "store/metrics.py:COST",
)
#: Features -> final model.
_TRAIN = (
    *_TASK,
    "evaluate/calibration.py",
    "evaluate/in_use.py",
    "evaluate/metrics.py",
    "evaluate/novelty.py",
    "evaluate/splits.py",
    "pipeline/train.py:train_final_model",
    "store/models.py",
    "store/tables.py:plain",
    "types/formats.py:MODEL_FORMAT",
)
#: Sources by type of job: files of the package, patterns, or `file:names` for definitions of a file
#: with what they use there. A test compares them with the imports.
CODE: dict[str, tuple[str, ...]] = {
    "gripper": _GRIPPER,
    "features": (
        *_RECORDINGS,
        *_SIMILAR,
        "features/levels.py",
        "pipeline/feature_file.py",
        "pipeline/session_levels.py",
        "pipeline/table_rows.py",
        "store/features.py:text_column,write_store",
        "store/findings.py",
        "store/labels.py",
        "types/issues.py:left_out",
        "types/formats.py:FEATURES_FORMAT",
        "types/robot_columns.py",
    ),
    "sample": (
        "pipeline/sample.py",
        "store/feature_array.py",
        "store/features.py",
        "store/labels.py:take_rows",
        "types/formats.py:FEATURES_FORMAT",
    ),
    "acquire": (
        *_SIMULATED,
        "acquire/writer.py",
        "pipeline/planned_grasps.py",
        "pipeline/recipes.py:acquire_virtual",
        "store/audio.py:FileHashes,SIMULATED,file_sha256,pcm24_bytes,write_pcm24",
        "store/files.py:numbered_rows,plain_text",
        "store/sessions.py:read_session,read_table,write_recordings,write_session",
        "types/issues.py:Finding",
        "types/names.py:NAME_PATTERN",
        "types/formats.py:SESSION_FORMAT",
        "types/session.py",
    ),
    "experiment": _EXPERIMENT,
    "experiment on recordings": (*_EXPERIMENT, *_RECORDINGS, *_OTHER_FEATURES),
    "experiment with copies": (*_EXPERIMENT, *_COPIES),
    "experiment on rendered sounds": (
        *_EXPERIMENT,
        *_RECORDINGS,
        *_OTHER_FEATURES,
        *_SIMULATED,
        "acquire/changed_grasps.py",
        "pipeline/planned_grasps.py",
        "pipeline/recipes.py:grasp_simulator,renderer",
        "types/base.py:overridden",
        "types/variants.py",
    ),
    "embed": (
        *_MODELS,
        "embed/encoder.py",
        "evaluate/embedding_data.py",
        "evaluate/splits.py",
        "pipeline/train.py:train_embedding",
        "store/feature_array.py",
        "store/features.py",
        "types/formats.py:LATENTS_FORMAT",
        "types/tasks.py:Embedding",
    ),
    "train": _TRAIN,
    "train with copies": (*_TRAIN, *_COPIES),
    "study": (
        *_GRIPPER,
        *_TABLES,
        "features/compute.py",
        "features/spectrum.py",
        "pipeline/studies.py:run_study",
        "store/feature_array.py",
        "studies/*.py",
        "studies/known_cases/*.py",
        "studies/resonators.yaml",
        *_SPECTRUM_SETTINGS,
        "types/settings.py",
    ),
    "collect": (
        "evaluate/agreement.py:why_undefined",
        "experiments/requests.py:Request,requested_experiments,requests_for",
        "experiments/division.py",
        "experiments/scores.py:PREDICTIONS,SCORES",
        "pipeline/collect.py",
        "pipeline/task_results.py:computed,measurements",
        "store/metrics.py",
        "store/tables.py:read_measurements",
        "types/formats.py:METRICS_FORMAT",
        "types/registry.py:PLAIN_MODELS",
        "types/table.py",
    ),
    "opening": (
        *_SIMULATED,
        *_TABLES,
        "evaluate/parts.py",
        "experiments/scores.py:PREDICTIONS",
        "pipeline/opening.py",
        "pipeline/planned_grasps.py:planned_grasps",
        "report/canvas.py",
        "report/format.py",
        "report/opening.py",
        "report/scenes.py",
        "store/audio.py:read_audio",
        "store/ffmpeg.py",
        "store/feature_array.py",
        "store/features.py:read_store",
        *_SPECTRUM_SETTINGS,
        "types/session.py:WHOLE_FILE,Segment",
        "types/settings.py",
    ),
    "publish": (
        "pipeline/dataset_summary.py",
        "pipeline/publish.py",
        "pipeline/published_tables.py",
        "pipeline/published_version.py",
        "pipeline/session_differences.py",
        "report/canvas.py",
        "report/card.py",
        "report/figures.py",
        "report/format.py",
        "report/marks.py",
        "report/render.py",
        "report/report_data.py:DatasetSummary,Illustration,IssueLine,Spectra,findings_by_code",
        "store/audio.py:FileHashes,file_sha256,segment_bytes",
        "store/changes.py",
        "store/feature_array.py",
        "store/features.py",
        "store/ffmpeg.py",
        "store/findings.py",
        "store/imported_table.py",
        "store/label_table.py",
        "store/labels.py",
        "store/publishing/*.py",
        "store/session_audio.py",
        "store/files.py:csv_bytes,json_bytes,numbered_rows,plain_text,yaml_bytes",
        "store/sessions.py:audio_path,read_recordings,read_session,write_session",
        "types/change.py",
        "types/errors.py:many",
        *_SPECTRUM_SETTINGS,
        "types/issues.py:Finding,WHOLE,flagged,left_out",
        "types/names.py:NAME_PATTERN",
        "types/formats.py:DATASET_FORMAT,PACKAGE_KEY,PUBLISHED_FORMAT,SESSION_FORMAT",
        "types/robot_columns.py",
        "types/session.py",
        "types/settings.py",
    ),
}
#: Packages whose files decide as a whole if a measurement uses them.
WHOLE_FILES = ("acquire", "embed", "evaluate", "features")
#: The package whose files decide by the definitions that a measurement uses: the others draw.
EXPERIMENTS_PACKAGE = "experiments"
#: Libraries whose versions can change any result.
NUMERICAL = ("numpy", "scipy", "soundfile")
#: The library whose version can also change simulations.
SIMULATING = "numba"
#: The library whose version can also change results of all models, and that of networks.
LEARNING = "scikit-learn"
NETWORKS = "torch"
#: Libraries whose versions can also change embeddings; umap-learn computes with numba.
EMBEDDING = ("numba", "torch", "umap-learn")
#: Types of jobs that simulate.
SIMULATIONS = ("gripper", "acquire", "study", "experiment on rendered sounds")
#: Types of jobs without models.
WITHOUT_MODELS = ("gripper", "features", "sample", "acquire", "study", "collect", "publish")


@dataclass(frozen=True)
class CodeSource:
    """A file that decides a result, or definitions of it (`names`) with what they use there."""

    file: Path
    names: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """Return the file relative to the package, or the last two parts of a file elsewhere.

        The folder of the package does not count, so that copies of a project have equal hashes.
        """
        if self.file.is_relative_to(PACKAGE):
            return self.file.relative_to(PACKAGE).as_posix()
        return "/".join(self.file.parts[-2:])

    def statements(self) -> list[ast.stmt]:
        """Return the statements of the file that decide, in the order of the file."""
        tree = deciding_tree(self.file)
        return used_statements(tree, self.names) if self.names else tree.body

    def digest(self) -> str:
        """Return the digest of what decides in the file; of other files than Python and YAML, every
        byte decides."""
        match self.file.suffix:
            case ".py":
                text = "\n".join(ast.dump(statement) for statement in self.statements())
            case ".yaml":
                text = json.dumps(read_yaml(self.file), sort_keys=True)
            case _:
                return sha256_of(self.file.read_bytes())
        return sha256_of(text.encode())


def sources(job_type: str) -> Iterator[CodeSource]:
    """Yield the sources of a type of job."""
    for listed in CODE[job_type]:
        pattern, _, names = listed.partition(":")
        for file in sorted(PACKAGE.glob(pattern)):
            yield CodeSource(file, tuple(filter(None, names.split(","))))


@functools.cache
def code_hash(job_type: str, *added: CodeSource, models: tuple[str, ...] | None = None) -> str:
    """Return the hash of the code of a type of job, and of the versions of its libraries.

    A rule has it as a parameter, so that its results are computed again if it changes. `added` are
    further sources. Models and features of other packages count as a whole. A library of an extra
    that is not installed has the version "". `models` are all models of the job, so that libraries
    of other models do not count; None if the job can have any model, or an embedding.
    """
    own = [*sources(job_type), *added]
    libraries = list(NUMERICAL)
    if job_type in SIMULATIONS:
        libraries.append(SIMULATING)
    if job_type not in WITHOUT_MODELS:
        libraries += [LEARNING, *_libraries_of(models)]
        own += [CodeSource(file) for file in _own_files([*OWN_MODELS, *OWN_FEATURES])]
    content = {
        "sources": sorted({f"{s.place}:{','.join(s.names)} {_digest(s)}" for s in own}),
        "libraries": {name: installed_version(name) for name in libraries},
    }
    return sha256_of(json.dumps(content, sort_keys=True).encode())[:16]


def _libraries_of(models: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the libraries that `models` need in addition to scikit-learn.

    Models of other packages may need any library.
    """
    own = {point.name for point in OWN_MODELS}
    if models is None or any(name in own or name not in MODELS for name in models):
        return EMBEDDING
    return (NETWORKS,) if any(MODELS[name].extra for name in models) else ()


def features_code(features: FeatureKind) -> str:
    """Return the hash of the code that computes the features of a kind.

    The code of the other kinds does not count. All files of another package count that its
    function imports from there.
    """
    own = type(features)
    module = own.function.partition(":")[0]
    if own is FeatureSettings:
        return code_hash("features")
    if own in SHIPPED:
        kind = CodeSource(PACKAGE / "types" / "features.py", (own.__name__, "ShortTime"))
        added = [kind, *(CodeSource(PACKAGE / file) for file in KINDS[module])]
        return code_hash("features", *added)
    files = _files_of((module, own.__module__))
    return code_hash("features", *(CodeSource(file) for file in files))


_SPECTROGRAM = "features/spectrogram.py"
#: Files of each kind of feature, by the module of its function.
KINDS = {
    "ajgdata.features.embedding": ("features/embedding.py",),
    "ajgdata.features.mel": ("features/mel.py", _SPECTROGRAM),
    "ajgdata.features.spectrogram": (_SPECTROGRAM,),
    "ajgdata.features.table": (
        "features/table.py",
        "store/imported_table.py",
        "store/label_table.py",
    ),
    "ajgdata.features.transfer_function": ("features/transfer_function.py", _SPECTROGRAM),
}
_digest = functools.cache(CodeSource.digest)


def used_sources(file: Path, function: str) -> tuple[CodeSource, ...]:
    """Return the sources that decide the result of a function in the file of an experiment.

    These are the definitions that it uses in its own module and in other modules of experiments,
    and complete files of `WHOLE_FILES`. For an experiment of another package, these are also the
    definitions that it uses in that package, and in every part of this one.
    """
    is_ours = file.is_relative_to(PACKAGE)
    waiting = [(file, function)]
    used: dict[Path, set[str]] = {}
    while waiting:
        file, name = waiting.pop()
        names = used.setdefault(file, set())
        if name in names:
            continue
        names.add(name)
        for other, imported in _imports_of(_source(file, {name})):
            if not is_ours or _package(other) in (EXPERIMENTS_PACKAGE, *WHOLE_FILES):
                waiting.append((other, imported))
    return tuple(_source(file, used[file]) for file in sorted(used))


@functools.cache
def _imports_of(source: CodeSource) -> tuple[tuple[Path, str], ...]:
    """Return file and name of what a source imports."""
    return tuple(imported_names(source.file, source.statements()))


def _source(file: Path, names: set[str]) -> CodeSource:
    """Return definitions of a file; the complete file if one of `names` is not defined there."""
    defined = {name for statement in deciding_tree(file).body for name in defined_names(statement)}
    is_whole = _package(file) in WHOLE_FILES or not names <= defined
    return CodeSource(file) if is_whole else CodeSource(file, tuple(sorted(names)))


def _package(file: Path) -> str:
    """Return the part of this package that has a file, for example `evaluate`; "" if none has."""
    return file.relative_to(PACKAGE).parts[0] if file.is_relative_to(PACKAGE) else ""


def imported_names(file: Path, statements: Iterable[ast.stmt]) -> Iterator[tuple[Path, str]]:
    """Yield file and name of what statements of `file` import, also in functions.

    Imports of this package and of the package of `file` are found, those of libraries are not. A
    module and `*` are names that their file does not define, so the file counts as a whole.
    """
    for node in (node for statement in statements for node in ast.walk(statement)):
        if isinstance(node, ast.ImportFrom):
            folder = _import_folder(file, str(node.module), node.level)
            if folder is not None:
                module = folder.joinpath(*(node.module or "").split("."))
                for alias in node.names:
                    target = _module_file(module / alias.name) or _module_file(module)
                    if target is not None:
                        yield target, alias.name
        elif isinstance(node, ast.Import):
            for alias in node.names:
                folder = _import_folder(file, alias.name, 0)
                target = _module_file(folder.joinpath(*alias.name.split("."))) if folder else None
                if target is not None:
                    yield target, alias.name


def _import_folder(file: Path, module: str, level: int) -> Path | None:
    """Return the folder in which an import of `file` starts; None for an import of a library."""
    if level:
        return file.parents[level - 1]
    root = file.parent
    while (root / "__init__.py").is_file():
        root = root.parent
    own = file.relative_to(root).with_suffix("").parts[0]
    return {PACKAGE.name: PACKAGE.parent, own: root}.get(module.partition(".")[0])


def _module_file(module: Path) -> Path | None:
    """Return the file of a module, whose path has no suffix; None if it does not exist."""
    files = (module.with_suffix(".py"), module / "__init__.py")
    return next((file for file in files if file.is_file()), None)


@functools.cache
def package_hash(*added: Path) -> str:
    """Return the hash of every byte of the package, and of the files `added`.

    The report depends on most files of the package, and syntax trees of all files take a second.
    """
    files = sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.yaml"), *added])
    lines = [f"{CodeSource(file).place} {sha256_of(file.read_bytes())}" for file in files]
    return sha256_of("\n".join(lines).encode())[:16]


def _own_files(points: Iterable[EntryPoint]) -> list[Path]:
    """Return the files of entry points in other packages, with what they import from there."""
    return _files_of(point.module for point in points)


def _files_of(modules: Iterable[str]) -> list[Path]:
    """Return the files of modules of other packages, with what they import from there."""
    specs = [find_spec(module) for module in modules]
    return with_own_imports(Path(spec.origin) for spec in specs if spec and spec.origin)


def with_own_imports(files: Iterable[Path]) -> list[Path]:
    """Return files of other packages, with the modules that they import from their packages."""
    waiting = list(files)
    known: set[Path] = set()
    while waiting:
        file = waiting.pop()
        if file not in known:
            known.add(file)
            imported = _imports_of(CodeSource(file)) if file.suffix == ".py" else ()
            waiting += [other for other, _ in imported if _package(other) == ""]
    return sorted(known)
