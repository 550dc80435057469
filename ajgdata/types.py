"""The nouns: what a data set declares, what a session says, what one recording is.

Nothing here opens a file. Every model forbids unknown keys, so that a typing error is an error;
`describe` turns pydantic's complaint into the one line that a person can act on.
"""

from __future__ import annotations

import dataclasses
import math
import re
import reprlib
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ValidationError,
    field_validator,
    model_validator,
)

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

NAME = re.compile(r"^[A-Za-z0-9][A-Za-z0-9_-]*$")
Name = Annotated[str, Field(pattern=NAME.pattern, description="letters, digits, _ and -")]
Kind = Literal["regression", "classification"]
ModelName = Literal["cnn", "linear", "knn", "svm", "boosting", "forest", "mlp"]

#: Columns of recordings.csv that mean the same in every data set; all others are declared targets
#: or free columns.
RECORDING_COLUMNS = ("recording_id", "file", "sha256", "grasp_id", "sample", "object", "quality")
#: Columns that session.yaml gives to every recording of a session.
SESSION_COLUMNS = ("source", "gripper", "medium")
#: Names that the feature store uses itself.
STORE_NAMES = ("recording", "session_id", "flags", "delay_samples", "feature", "frequency")


class DataError(Exception):
    """One thing wrong with the data, said in one line: where, what, and how to mend it."""

    def __init__(self, where: object, problem: str, fix: str) -> None:
        super().__init__(f"{where}: {problem}; {fix}")
        self.where, self.problem, self.fix = str(where), problem, fix

    def __reduce__(self) -> tuple[type[DataError], tuple[str, str, str]]:
        """Comes back whole from another process, which the joined text alone would not."""
        return type(self), (self.where, self.problem, self.fix)


@dataclasses.dataclass(frozen=True, order=True)
class Finding:
    """What a check says of one recording (or, with recording_id `*`, of a whole session).

    `level` is *error* (unusable: the recording is quarantined), *warning* (used, but somebody
    should look) or *note* (unusual and fine). `code` is a stable slug such as `truncated`.
    """

    session_id: str
    recording_id: str
    file: str
    level: Literal["error", "warning", "note"]
    code: str
    problem: str
    fix: str

    @property
    def leaves_out(self) -> bool:
        """Whether the recording is not in the feature store."""
        return self.level == "error" or self.code in ("copy", "rejected")


class Strict(BaseModel):
    """Base of every model: unknown keys are errors, instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class FeatureSettings(Strict):
    """Signal -> spectrum. The paper gives the window (2048), the sum over time and *a*
    normalisation; window shape, hop, magnitude or power, and which norm are ours."""

    window: int = Field(2048, ge=16, description="STFT window and FFT length in samples (paper)")
    hop: int = Field(512, ge=1, description="samples between windows (the paper leaves it open)")
    window_shape: Literal["hann", "hamming", "blackman", "boxcar"] = Field(
        "hann", description="periodic window function (the paper leaves it open)"
    )
    quantity: Literal["magnitude", "power"] = Field(
        "magnitude", description="|X| or |X|^2, summed over time (the paper leaves it open)"
    )
    normalisation: Literal["l1", "l2", "max", "none"] = Field(
        "l1", description="what each spectrum is divided by (the paper says only 'normalise')"
    )
    band_hz: tuple[float, float] | None = Field(
        None, description="keep bins with low <= f <= high; null keeps all window/2 + 1"
    )
    align: bool = Field(
        False, description="shift each recording to the excitation by cross-correlation first"
    )

    @model_validator(mode="after")
    def _ordered(self) -> FeatureSettings:
        if self.hop > self.window:
            raise ValueError(f"hop {self.hop} exceeds window {self.window}: samples would be lost")
        if self.band_hz and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz {self.band_hz} must be 0 <= low < high")
        return self


class AudioSettings(Strict):
    """What the recordings of a data set are, and what may be done to those that differ."""

    sample_rate_hz: int = Field(44_100, ge=1_000, le=768_000, description="declared rate")
    other_rate: Literal["reject", "resample"] = Field(
        "reject", description="a recording at another rate is quarantined, or resampled (polyphase)"
    )
    channel: Literal["mono", "mean"] | Annotated[int, Field(ge=0)] = Field(
        "mono", description="'mono': reject others; a number: take that channel; 'mean': average"
    )


class Target(Strict):
    """One label column."""

    kind: Kind
    unit: str = Field("", description="unit of a regression target, e.g. mm; empty for classes")
    description: str = ""
    missing: tuple[str, ...] = Field((), description="cell texts that mean 'not measured'")


class Level(Strict):
    """What differs between data sets that one model is tested on, as a number."""

    value: float
    unit: str = ""
    quantity: str = Field(description="e.g. sound level outside")


class Curve(Strict):
    """Learning curve: training grasps per class, each drawn `repeats` times."""

    groups: tuple[Annotated[int, Field(ge=1)], ...] = Field(min_length=2)
    repeats: int = Field(5, ge=2)
    models: tuple[ModelName, ...] = Field(("cnn", "linear", "knn"), min_length=1)


class Sorting(Strict):
    """Sorting by sound, offline: objects in random order until none is probable enough."""

    objects: tuple[str, ...] = Field(min_length=2, description="values of the target")
    threshold: float = Field(0.6, gt=0, le=1, description="probability that is enough (paper)")
    models: tuple[ModelName, ...] = Field(("cnn",), min_length=1)


class Task(Strict):
    """Target + split: one row of the report for each model."""

    target: str
    groups: str = Field("grasp_id", description="column whose values never straddle folds")
    folds: int = Field(5, ge=2)
    models: tuple[ModelName, ...] = ("cnn", "linear", "knn")
    compare_random: bool = Field(
        False, description="also evaluate a split that ignores the groups, to show what it flatters"
    )
    withhold: tuple[float, ...] = Field(
        (), description="target values that no fold trains on; every fold's model is tested on them"
    )
    period_deg: float | None = Field(
        None,
        gt=0,
        description="the target repeats after this, as a bar's angle after 180: models learn sine "
        "and cosine, errors are the shortest way round",
    )
    test_on: tuple[Name, ...] = Field(
        (),
        description="data sets whose recordings the folds' models are tested on as well, e.g. the "
        "same grasps under noise; of a grasp that both hold, only the fold that holds it out",
    )
    curve: Curve | None = Field(None, description="accuracy against number of training grasps")
    permutations: int = Field(
        0, ge=0, description="labels permuted so often for a test against chance; 0: no test"
    )
    sorting: Sorting | None = Field(None, description="sorting by this target's classes")
    paper: str | dict[str, str] = Field(
        "",
        description="rows of the paper's figures to stand beside, e.g. ycb, or by part (known, "
        "unknown, overall, or a data set of test_on): {known: size-known, size_80dba: noise}",
    )

    @property
    def papers(self) -> dict[str, str]:
        """Rows of the paper's figures by part of the evaluation."""
        given = self.paper
        return ({"known": given} if given else {}) if isinstance(given, str) else given

    @model_validator(mode="after")
    def _distinct(self) -> Task:
        if len(set(self.withhold)) != len(self.withhold):
            raise ValueError("withhold lists a value twice")
        parts = ("known", *(("unknown", "overall") if self.withhold else ()), *self.test_on)
        if more := sorted(set(self.papers) - set(parts)):
            raise ValueError(f"paper.{more[0]} is no part of this task: it has {', '.join(parts)}")
        return self


class RecipeObject(Strict):
    """One object of a recipe: its scene description and the labels it gets."""

    name: Name
    shape: str | dict[str, JsonValue] = Field(
        description="the gripper's object description, or a name of its library"
    )
    targets: dict[str, float | str] = {}
    grasp: dict[str, JsonValue] = Field(
        {}, description="its own grasp settings, e.g. angle_deg: 9; what `vary` draws goes before"
    )


class Recipe(Strict):
    """How the virtual gripper makes a data set."""

    source: Literal["virtual"] = "virtual"
    seed: int = 0
    sessions: int = Field(1, ge=1)
    grasps_per_object: int = Field(
        ge=1, description="grasps of each object per session, each with its own nuisances"
    )
    samples_per_grasp: int = Field(1, ge=1)
    scene: dict[str, JsonValue] = Field({}, description="overrides of the gripper's default scene")
    signal: dict[str, JsonValue] = Field(
        {},
        description="overrides of its default signal chain, e.g. external_noise_dba: 80; they need"
        " no new simulation",
    )
    grasps_of: Name | None = Field(
        None,
        description="draw the same grasps as the recipe of this data set, e.g. to record them again"
        " under other noise",
    )
    vary: dict[str, tuple[float, float]] = Field(
        {}, description="grasp settings drawn uniformly for each grasp, e.g. angle_deg: [-10, 10]"
    )
    objects: tuple[RecipeObject, ...] = Field(min_length=1)

    @field_validator("objects")
    @classmethod
    def _distinct(cls, objects: tuple[RecipeObject, ...]) -> tuple[RecipeObject, ...]:
        names = [o.name for o in objects]
        if len(set(names)) != len(names):
            raise ValueError("two objects share a name")
        return objects

    @model_validator(mode="after")
    def _drawable(self) -> Recipe:
        for key, (low, high) in self.vary.items():
            if low > high:
                raise ValueError(f"vary.{key} = [{low:g}, {high:g}] must be [low, high]")
        if not isinstance(self.scene.get("grasp", {}), dict):
            raise ValueError("scene.grasp must hold keys")
        return self


class ImportSettings(Strict):
    """How a folder of recordings becomes sessions; the options of `ajgdata import`."""

    pattern: str = Field("", description="'starter-kit' or a regular expression with named groups")
    table: str = Field("", description="CSV of labels inside the folder, instead of a pattern")
    file: str = Field("", description="with table: path of a row's file, e.g. 'wav/{name}.wav'")
    grasp: str = Field("", description="template of grasp_id, e.g. '{stone}'; default: the file")
    object: str = Field("", description="template of object, e.g. '{label}'; default: the label")
    session: str = Field("", description="template of the session; default: the folder")

    @model_validator(mode="after")
    def _one_way(self) -> ImportSettings:
        if self.pattern and self.table:
            raise ValueError("give pattern or table, not both")
        if bool(self.table) != bool(self.file):
            raise ValueError("table needs file (a template such as 'audio/{name}.wav')")
        return self


TRAINING = ("target", "kind", "unit", "groups", "period_deg")


class DatasetSpec(Strict):
    """dataset.yaml: what a data set is."""

    name: Name
    title: str = ""
    description: str = ""
    licence: str = "not stated"
    citation: str = ""
    url: str = ""
    audio: AudioSettings = AudioSettings()
    features: FeatureSettings = FeatureSettings()
    targets: dict[Name, Target] = {}
    tasks: dict[Name, Task] = {}
    level: Level | None = Field(
        None, description="where it stands among the data sets that a task is tested on"
    )
    recipe: Recipe | None = None
    imports: ImportSettings = ImportSettings()

    @model_validator(mode="after")
    def _consistent(self) -> DatasetSpec:
        for name in self.targets:
            if is_reserved(name) and name not in ("object", *SESSION_COLUMNS):
                raise ValueError(f"target {name} has the name of a standard column")
        if self.recipe:
            for made in self.recipe.objects:
                if unknown := set(made.targets) - set(self.targets):
                    raise ValueError(f"object {made.name}: unknown targets {sorted(unknown)}")
        if self.features.band_hz:
            bins_per_hz = self.features.window / self.audio.sample_rate_hz
            low, high = (edge * bins_per_hz for edge in self.features.band_hz)
            if math.ceil(low) > min(math.floor(high), self.features.window // 2):
                raise ValueError(f"features.band_hz {self.features.band_hz} holds no bin")
        return self

    @model_validator(mode="after")
    def _tasks_of_targets(self) -> DatasetSpec:
        for name, task in self.tasks.items():
            if task.target not in self.targets:
                raise ValueError(f"task {name}: target {task.target!r} is not among the targets")
            if self.targets[task.target].kind == "classification":
                for key in ("withhold", "period_deg"):
                    if getattr(task, key):
                        raise ValueError(f"task {name}: {key} is for a number, not for classes")
            elif task.sorting:
                raise ValueError(f"task {name}: sorting is for classes, not for a number")
        return self

    def evaluation(self, task: str) -> dict[str, Any]:
        """What an evaluation of `task` must know, by name."""
        settings = self.tasks[task]
        target = self.targets[settings.target]
        return {
            "target": settings.target,
            "kind": target.kind,
            "unit": target.unit,
            "groups": settings.groups,
            "folds": settings.folds,
            "compare_random": settings.compare_random,
            "withhold": list(settings.withhold),
            "period_deg": settings.period_deg,
            "test_on": list(settings.test_on),
        }

    def experiment(self, task: str) -> dict[str, Any]:
        """What the further experiments on `task` must know, by name."""
        left_out = ("compare_random", "test_on")
        return {k: v for k, v in self.evaluation(task).items() if k not in left_out}

    def training(self, task: str) -> dict[str, Any]:
        """What training a model for `task` must know, by name."""
        return {k: v for k, v in self.evaluation(task).items() if k in TRAINING}


class Excitation(Strict):
    """The played sound."""

    file: str = Field(description="relative to the session folder")
    sha256: str
    description: str = ""


class Session(Strict):
    """session.yaml: one uninterrupted acquisition with one gripper."""

    session_id: Name
    source: Literal["virtual", "soundcard", "import"]
    gripper: str = "unknown"
    medium: str = "unknown"
    device: str = "unknown"
    sample_rate_hz: int | None = Field(None, description="null when the recordings differ")
    excitation: Excitation | None = None
    audio_root: str | None = Field(
        None, description="folder the files are relative to; null: the session folder"
    )
    software: str = Field("", description="what wrote this session")
    scene: dict[str, Any] = Field({}, description="settings of the source, for provenance")
    skipped: dict[str, str] = Field({}, description="grasps that could not be made, and why")
    notes: str = ""


class Recording(Strict):
    """One row of recordings.csv. `labels` holds every further column as text."""

    recording_id: Annotated[str, Field(min_length=1, max_length=200)]
    file: Annotated[str, Field(min_length=1)]
    sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = Field(
        "", description="empty: not sealed yet"
    )
    grasp_id: Annotated[str, Field(min_length=1)]
    sample: int = Field(0, ge=0)
    object: str = ""
    quality: str = Field("ok", description="'reject' keeps a recording out; other text is kept")
    labels: dict[str, str] = {}


def is_reserved(name: str) -> bool:
    """Whether a label column cannot have this name, because another column of the store has it."""
    standard = (*RECORDING_COLUMNS, *SESSION_COLUMNS, *STORE_NAMES)
    return name in standard or re.fullmatch(r"string\d+", name) is not None  # netCDF dimensions


def describe(error: ValidationError, where: object) -> DataError:
    """Name file, key, value and fix of the first complaint in `error`."""
    errors = error.errors()
    first, *others = errors
    place = first["loc"]
    # Where a value may be of several types, pydantic complains once for each: say it together.
    alternatives = []
    if place and re.fullmatch(r"float|str|(constrained-)?int|.*\[.*\]", str(place[-1])):
        place = place[:-1]
        alternatives = [e for e in others if e["loc"][:-1] == place]
    key = " ".join(".".join(str(part) for part in place).split())
    left = len(others) - len(alternatives)
    more = f" (and {left} more)" if left else ""
    if first["type"] == "extra_forbidden":
        return DataError(where, f"unknown key {key}{more}", "correct its spelling or remove it")
    if first["type"] == "union_tag_not_found":
        key = f"{key}.{first['ctx']['discriminator']}".replace("'", "")
    if first["type"] in ("missing", "union_tag_not_found"):
        return DataError(where, f"{key} is missing{more}", f"add {key}")
    if first["type"] == "union_tag_invalid":
        said = "{discriminator} {tag!r} is none of {expected_tags}".format_map(first["ctx"])
        return DataError(where, f"{key}: {said}{more}", "correct the value")
    value = "" if isinstance(first["input"], dict) else f" = {reprlib.repr(first['input'])}"
    message = " or ".join(
        [_message(first), *(_message(e, "Input should be ") for e in alternatives)]
    )
    return DataError(where, f"{key or 'content'}{value}: {message}{more}", "correct the value")


def _message(error: ErrorDetails, without: str = "Value error, ") -> str:
    if error["type"] == "string_pattern_mismatch" and error["ctx"]["pattern"] == NAME.pattern:
        return "Names are letters, digits, _ and -, and begin with a letter or digit"
    return error["msg"].removeprefix(without)
