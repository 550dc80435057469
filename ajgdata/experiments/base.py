"""The protocol of an experiment: settings -> measure() -> tables -> figures, rows, comparison.

An experiment is one module that ends in `EXPERIMENT = Experiment(...)`. Its settings are in a task
of dataset.yaml, under `experiments`, by its name. The tables that `measure` returns are stored, and
figures and rows are made from these tables only: nothing is measured while a report is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ajgdata.evaluate.agreement import NO_BETTER, UNDEFINED, Estimate, PaperVerdict
from ajgdata.evaluate.task_data import (
    TaskData,
    TrainingCopies,
    classes_of,
    input_layout,
    split_withheld,
    task_data,
)
from ajgdata.experiments.plots import BoundPlot, Plot
from ajgdata.experiments.spec import ExperimentSpec
from ajgdata.paths import short_name
from ajgdata.report.comparison import PaperComparison, PaperFigure
from ajgdata.report.format import Source, words
from ajgdata.report.report_data import Illustration, ResultRow
from ajgdata.store.features import FeatureRows, Latents
from ajgdata.types import AudioSettings, FeatureKind, FeatureSettings, Level, TaskSettings
from ajgdata.types.input_layout import InputLayout
from ajgdata.types.registry import PAPER_MODEL
from ajgdata.types.table import Table

if TYPE_CHECKING:
    from ajgdata.acquire.changed_grasps import GraspSimulator

#: Longest names of a task and of a part in names of files. File systems allow 255 bytes.
LONGEST_TASK = 150
LONGEST_PART = 60
#: Function that simulates other sounds in the scenes of recordings. Its arguments are names of
#: recordings and sounds (n,). It yields for each recording the samples (n,) with each sound, and
#: raises ValueError for a recording that was not simulated.
Render = Callable[[Sequence[str], Sequence[np.ndarray]], Iterator[list[np.ndarray]]]


class Recordings(Protocol):
    """Reader of recordings of the data set and of the data sets in the settings."""

    def samples(
        self, dataset: str, names: Sequence[str], least_samples: int
    ) -> Iterator[np.ndarray]:
        """Yield the samples of recordings of a data set by name, with at least `least_samples`.

        Raises NotPossibleError for a recording that cannot be used.
        """
        ...

    def played(self, dataset: str, name: str) -> np.ndarray:
        """Return the samples (m,) of the sound that the session of a recording played.

        Raises NotPossibleError if there is no such sound.
        """
        ...


class CopyMaker(Protocol):
    """Source of the changed copies of recordings that a task with `augment` trains on."""

    def copies(self, dataset: str, names: Sequence[str]) -> TrainingCopies:
        """Return the copies of recordings of a data set; `names` (n,) are those of the rows.

        Raises NotPossibleError for a recording that cannot be used.
        """
        ...


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of a measurement: a task, its features and recordings.

    `store` are the features of the data set, and `other_sets` those of the data sets that the
    settings of the experiment name in `test_on` and `placebo`. `recordings` reads recordings if the
    experiment `reads_recordings`. If it `renders`, `render` simulates other sounds, and `grasps`
    the grasps of the recipe. `copy_maker` is None without `augment`. `other_tasks` are those of the
    data set that the settings name. For an embedding, `task` is its name, and `latents` and
    `training_cost` are of its encoders. `folder` is that of dataset.yaml.
    """

    dataset: str
    task: str
    task_settings: TaskSettings
    seed: int
    store: FeatureRows
    other_sets: Mapping[str, FeatureRows] = field(default_factory=dict)
    audio: AudioSettings = field(default_factory=AudioSettings)
    features: FeatureKind = field(default_factory=FeatureSettings)
    recordings: Recordings | None = None
    render: Render | None = None
    grasps: GraspSimulator | None = None
    copy_maker: CopyMaker | None = None
    other_tasks: Mapping[str, TaskSettings] = field(default_factory=dict)
    latents: Latents | None = None
    training_cost: Mapping[str, float] = field(default_factory=dict)
    folder: Path = Path()

    def all_data(self, other: str = "", groups: str = "") -> TaskData:
        """Return the recordings with the target, of the data set or of the data set `other`.

        If the task names `classes`, only these are included. `groups` is a column, by default that
        of the task. Raises ValueError without recordings; see `task_data`.
        """
        table = self.store if other in ("", self.dataset) else self.other_sets[other]
        task = self.task_settings
        column = groups or task.groups
        classes = self.classes_of_task[0]
        without = task.placebo_objects
        return task_data(
            table,
            task.target,
            task.kind,
            column,
            classes,
            without,
            task.axes,
            task.covariates,
        )

    @property
    def layout(self) -> InputLayout:
        """Return the layout of the features of `all_data`."""
        return input_layout(self.store, self.task_settings)

    def copies(self, data: TaskData, other: str | None = None) -> TrainingCopies | None:
        """Return the copies of recordings of the data set, or of the data set `other`.

        None if the task has no `augment`. Raises NotPossibleError for a recording without file.
        """
        if self.copy_maker is None:
            return None
        return self.copy_maker.copies(other or self.dataset, data.name.tolist())

    def placebo_data(self, other: str | None) -> TaskData | None:
        """Return the recordings of one object under several names; None if there are none.

        They are in the data set `other`, with the classes or training values of the task, or else
        the placebo objects of the store, with their names as values. Names are no numbers, so a
        regression has no placebo objects.
        """
        if other is not None:
            return self.data(other)
        task = self.task_settings
        if not task.placebo_objects or task.kind != "classification":
            return None
        return task_data(
            self.store,
            "object",
            "classification",
            task.groups,
            task.placebo_objects,
            covariates=task.covariates,
        )

    @property
    def classes_of_task(self) -> tuple[Sequence[str], Mapping[str, int]]:
        """Return the classes of the task (none: all), and the excluded classes.

        An excluded class has fewer than `min_groups` groups; the mapping has its number of groups.
        Raises NotPossibleError if too few classes remain.
        """
        return classes_of(self.store, self.task_settings)

    def data(self, other: str = "") -> TaskData:
        """Return the recordings of `all_data` whose value is not withheld from training."""
        return split_withheld(self.all_data(other), self.task_settings.withhold)[0]

    def fold_count(self, group: np.ndarray) -> int:
        """Return the number of folds for recordings with a `group` (n,): at most one per group."""
        return min(self.task_settings.folds, len(np.unique(group)))


@dataclass(frozen=True)
class Outcome:
    """The result of a measurement. `tables` follow from the inputs; `cost` differs between runs."""

    tables: tuple[Table, ...]
    cost: tuple[Table, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Result:
    """A stored outcome of one model, or of all models together (`model` is then "")."""

    model: str
    label: str  #: the model's name for people
    about: Mapping[str, Any]
    tables: Mapping[str, Table]
    cost: Mapping[str, Table]


@dataclass(frozen=True)
class Other:
    """Title and level of another data set that a task is tested on."""

    title: str
    level: Level | None = None


@dataclass(frozen=True, eq=False)
class TaskResults:
    """The results of one experiment on one task, in the order of its models.

    - `papers` are published values by the compared part of the task.
    - `mirror_deg` is the mirror plane of the gripper if the target is an angle.
    - `left_out` are excluded classes with their number of groups.
    - `page` is the name of the page of the report.
    - `same_page` are the results of the experiment on all tasks of the page.
    """

    experiment: str
    dataset: str
    dataset_title: str
    task: str
    task_settings: TaskSettings
    source: Source
    settings: Any
    results: tuple[Result, ...]
    papers: Mapping[str, PaperFigure] = field(default_factory=dict)
    other_sets: Mapping[str, Other] = field(default_factory=dict)
    level: Level | None = None
    mirror_deg: float | None = None
    left_out: Mapping[str, int] = field(default_factory=dict)
    page: str = ""
    same_page: tuple[TaskResults, ...] = ()

    @property
    def first_result(self) -> Result:
        """Return the result of the paper's model, or without it that of the first model."""
        by_model = {result.model: result for result in self.results}
        return by_model.get(PAPER_MODEL, self.results[0])

    @property
    def title(self) -> str:
        """Return data set and task as a heading."""
        return f"{self.dataset_title} · {self.task.replace('_', ' ')}"

    @property
    def paper(self) -> PaperFigure | None:
        """Return the published value that is compared with the complete experiment."""
        return self.papers.get(self.experiment)

    @property
    def metric(self) -> str:
        """Return the first metric of the task: `rmse` or `accuracy`."""
        return "rmse" if self.task_settings.kind == "regression" else "accuracy"

    @property
    def metric_title(self) -> str:
        """Return the first metric of the task for people: `RMSE` or `accuracy`."""
        return "RMSE" if self.task_settings.kind == "regression" else "accuracy"

    @property
    def scale(self) -> int:
        """Return the factor from a metric to its shown value: accuracies are shown in per cent."""
        return 100 if self.task_settings.kind == "classification" else 1

    @property
    def target_title(self) -> str:
        """Return the target for people, without its unit: `edge`."""
        task = self.task_settings
        suffix = "deg" if task.unit == "°" else task.unit
        return words(task.target.removesuffix(f"_{suffix}"))

    @property
    def shown_unit(self) -> str:
        """Return the unit of the metric as it is shown."""
        task = self.task_settings
        return "%" if task.kind == "classification" else task.unit

    def title_of(self, dataset: str) -> str:
        """Return the title of the data set of the task, or of another tested data set."""
        if dataset == self.dataset:
            return self.dataset_title
        return self.other_sets[dataset].title if dataset in self.other_sets else words(dataset)

    def with_chance_note(self, text: str, value: float, chance: float) -> str:
        """Return the text of a result, with a note if its `value` is not better than chance.

        `value` and `chance` are in shown units.
        """
        perfect = 100.0 if self.task_settings.kind == "classification" else 0.0
        if Estimate(value, UNDEFINED, chance, perfect).is_better_than_chance:
            return text
        return f"{text}, {NO_BETTER}"

    def compared(
        self, paper: PaperFigure, result: str, model: str, agrees: PaperVerdict, **fields: Any
    ) -> PaperComparison:
        """Return a row of the comparison with the paper; `fields` are its further fields."""
        fields = {"experiment": self.experiment} | fields
        return PaperComparison(
            paper, self.dataset, self.task, self.source, result, model, agrees, **fields
        )

    def named(self, *parts: str) -> str:
        """Return the file name, without suffix, of a figure of this experiment."""
        task = "--".join((self.experiment.replace("_", "-"), self.dataset, self.task))
        names = [short_name(task, LONGEST_TASK), *(short_name(p, LONGEST_PART) for p in parts)]
        return "--".join(names)


#: Results of other experiments of the run, by experiment, data set and task.
Lookup = Callable[[str, str, str], "TaskResults | None"]


@dataclass(frozen=True)
class Experiment:
    """An experiment: its specification, its measurement, and its figures and rows.

    `measure(inputs, settings, part)` raises NotPossibleError for a task that lacks what it needs.

    `plots` declare its figures, or a function returns them for the results. Figures and rows of the
    table of results follow from them, unless `own_rows` returns the rows. `own_figures` returns
    figures that no mark draws; on the page, they are above those of the plots.

    `summary` is the text above the figures of a task. `advice` are lines of the next steps.
    """

    spec: ExperimentSpec
    measure: Callable[[Inputs, Any, str], Outcome]
    plots: Sequence[Plot] | Callable[[TaskResults], Sequence[Plot]] = ()
    own_figures: Callable[[TaskResults], Iterable[Illustration]] = lambda results: ()
    own_rows: Callable[[TaskResults], Iterable[ResultRow]] | None = None
    paper_comparison: Callable[[TaskResults, Lookup], Iterable[PaperComparison]] = lambda *_: ()
    summary: Callable[[TaskResults], str] = lambda results: ""
    advice: Callable[[TaskResults], Iterable[str]] = lambda results: ()

    def figures(self, results: TaskResults) -> Iterable[Illustration]:
        """Return its own figures, and the figures of its plots that have something to draw."""
        drawn = [plot.illustration for plot in self.bound_plots(results) if plot.has_points]
        return [*self.own_figures(results), *drawn]

    def rows(self, results: TaskResults) -> Iterable[ResultRow]:
        """Return its rows in the table of results: its own, or those of its `listed` plots."""
        if self.own_rows:
            return self.own_rows(results)
        listed = [plot for plot in self.bound_plots(results) if plot.plot.listed]
        return [row for plot in listed for row in plot.rows()]

    def bound_plots(self, results: TaskResults) -> list[BoundPlot]:
        """Return its plots of the results of a task."""
        plots = self.plots(results) if callable(self.plots) else self.plots
        return [plot.bind(results) for plot in plots]
