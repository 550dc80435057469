"""`ajgdata import`: import a folder of recordings into a data set, and print a summary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.markup import escape
from rich.table import Table

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, AllOption, out, print_facts, say, shortened
from ajgdata.paths import Paths, find_project
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    ImportSettings,
    OnChange,
    checked,
    checked_name,
)
from ajgdata.types.settings import Microphone, microphone_text
from ajgdata.types.shell import shell_quoted

if TYPE_CHECKING:
    from ajgdata.pipeline.importing import Imported

#: Colours of the types of remarks, the worst type first.
REMARK_COLOURS = {
    "failed": "red",
    "unreadable": "yellow",
    "kept": "yellow",
    "label": "yellow",
    "warning": "yellow",
    "unused": "yellow",
    "gone": "yellow",
    "channels": "yellow",
    "not used": "default",
    "note": "yellow",
}
Pattern = Annotated[
    str,
    typer.Option(help="'starter-kit' (<n>_<label>.wav), or a regular expression with named groups"),
]
TableOption = Annotated[str, typer.Option(help="table of labels; with *, one table per folder")]
ObjectOption = Annotated[
    str, typer.Option("--object", help="object, or its template, e.g. '{stone}'")
]
TargetOption = Annotated[
    list[str] | None, typer.Option(help="label to predict, or `object`; repeatable")
]
SegmentsOption = Annotated[
    Literal["track", "table"] | None,
    typer.Option(help="files with many sounds: labels of Audacity (track) or table"),
]
FeaturesOption = Annotated[
    Path | None, typer.Option(help="table of features without recordings: CSV, TSV or Parquet")
]
FeatureColumnsOption = Annotated[
    str, typer.Option(help="columns that are features: a regular expression")
]
OnChangeOption = Annotated[
    OnChange, typer.Option(help="differences to take from the folder in a second import")
]


def import_command(
    dataset: Annotated[
        str, typer.Option(help="data set; created if it is new", autocompletion=dataset_names)
    ],
    folder: Annotated[Path | None, typer.Argument(help="folder with the recordings")] = None,
    features: FeaturesOption = None,
    feature_columns: FeatureColumnsOption = "",
    pattern: Pattern = "",
    table: TableOption = "",
    file: Annotated[str, typer.Option(help="template of a row's file, e.g. 'wav/{name}.wav'")] = "",
    grasp: Annotated[str, typer.Option(help="template of grasp_id, e.g. '{stone}'")] = "",
    placement: Annotated[
        str, typer.Option(help="template of placement_id, e.g. '{object}/{round}'")
    ] = "",
    session: Annotated[str, typer.Option(help="session, or its template, e.g. '{day}'")] = "",
    object_: ObjectOption = "",
    segments: SegmentsOption = None,
    period: Annotated[
        float | None, typer.Option(help="length of segments in s, per file or label")
    ] = None,
    offset: Annotated[
        float | None, typer.Option(help="time before the first segment in s, with --period")
    ] = None,
    target: TargetOption = None,
    reference: Annotated[
        bool, typer.Option("--reference", help="leave the audio in the folder")
    ] = False,
    on_change: OnChangeOption = OnChange.KEEP,
    microphone: Annotated[
        str, typer.Option(help="channel: number from 1, numbers 1,2, all or mean")
    ] = "",
    everything: AllOption = False,
) -> None:
    """Import a folder of recordings as sessions of a data set.

    Groups of a pattern, and columns of a table, are labels, or session, placement, grasp, object,
    sample and quality. A second import adds new recordings and lists differences. Exit code 3 if
    recordings of the data set were skipped or cannot be used, or if there are warnings.

    With --features, each row of a table is a recording without sound.
    """
    from ajgdata.pipeline.importing import import_folder
    from ajgdata.pipeline.table_import import import_table

    paths = find_project()
    known = paths.dataset(checked_name(dataset)).is_file()
    rules = {"labels": segments, "period_s": period, "offset_s": offset}
    given_rules = {key: value for key, value in rules.items() if value is not None}
    settings = _import_settings(
        pattern=pattern,
        table=table,
        file=file,
        grasp=grasp,
        placement=placement,
        session=session,
        object=object_,
        segments=given_rules,
    )
    if features is not None:
        refuse_options({"FOLDER": folder, "--reference": reference, "--microphone": microphone})
        spec, result = import_table(
            paths,
            dataset,
            features,
            settings=settings,
            columns=feature_columns,
            targets=target or [],
            on_change=on_change,
        )
    else:
        if folder is None:
            fix = "name a folder with recordings, or a table with --features"
            raise DataError("ajgdata import", "FOLDER is missing", fix)
        if feature_columns:
            raise DataError("--feature-columns", "requires --features", "add --features TABLE")
        if not (known or pattern or table or given_rules):
            check_file_names(folder)
        spec, result = import_folder(
            paths,
            dataset,
            folder,
            settings=settings,
            targets=target or [],
            copy=not reference,
            on_change=on_change,
            microphone=_microphone(microphone),
        )
    show_import(result, dataset, everything=everything)
    is_ambiguous = False
    if paths.dataset(dataset).is_file():
        is_ambiguous = show_summary(paths, spec, known=known)
    raise typer.Exit(0 if result.is_complete and not is_ambiguous else ATTENTION)


def refuse_options(options: dict[str, object]) -> None:
    """Raise DataError for an option of recordings that is given with a table of features."""
    for option, value in options.items():
        if value:
            problem = "is for recordings, and --features names a table without recordings"
            raise DataError(option, problem, f"remove {option}")


def check_file_names(folder: Path) -> None:
    """Raise DataError if file names in a folder are not of the form `<n>_<label>.wav`.

    Prints the fields of the file names first, and patterns that a user can copy.
    """
    from ajgdata.store.file_names import ambiguous_readings, folder_pattern, name_form
    from ajgdata.store.scan import search
    from ajgdata.store.starter_kit import starter_kit_objection

    if not folder.is_dir():
        return  # the import reports this error
    files, _ = search(folder)
    objection = starter_kit_objection(files) if files else ""
    if not objection:
        return
    form = name_form(files)
    table = Table("field", "kind", "values", "examples", box=None)
    for number, field in enumerate(form.fields, 1):
        examples = ", ".join(field.values[:4])
        table.add_row(str(number), field.value_type, str(len(field.values)), escape(examples))
    say(f"{len(form.files)} of {len(files)} file names have this form (fields from left to right):")
    out.print(table)
    for path in form.other_files[:3]:
        say(f"[yellow]other form[/yellow] {escape(path.as_posix())}")
    for reading in ambiguous_readings(form):
        say(f"[yellow]note[/yellow] {escape(reading)}")
    say("Patterns to copy and edit (label: to predict; grasp, sample: counters; field_N: stored):")
    pattern_of_folders = folder_pattern(files)
    if pattern_of_folders:
        say(escape(f"  --pattern {shell_quoted(pattern_of_folders)}   (the folder is the label)"))
    for roles in form.proposals():
        options = f"--pattern {shell_quoted(form.pattern(roles))}"
        template = form.grasp_template(roles)
        if template:
            options += f" --grasp {shell_quoted(template)}"
        say(escape(f"  {options}"))
    fix = "add a --pattern, or --table; --pattern starter-kit reads <n>_<label>.wav unchecked"
    raise DataError(folder, objection, fix)


def _import_settings(**options: Any) -> ImportSettings | None:
    """Return the settings of the options that are not empty; None if all are empty."""
    given = {key: value for key, value in options.items() if value}
    if not given:
        return None
    return checked(ImportSettings, "ajgdata import", given)


def _microphone(text: str) -> Microphone | Literal["all"]:
    """Return the value of the option `--microphone`; None if it is empty.

    Raises DataError for an invalid value.
    """
    if text == "all":
        return "all"
    if not text:
        return None
    parts = text.split(",")
    value: object = text
    if all(part.isascii() and part.isdigit() for part in parts):
        numbers = [int(part) for part in parts]
        value = numbers[0] if len(numbers) == 1 else numbers
    return checked(AudioSettings, "--microphone", {"microphone": value}).microphone


def show_import(result: Imported, dataset: str, *, everything: bool) -> None:
    """Print the counts and remarks of an import, the worst first."""
    counts = f"{result.added} added, {result.changed} changed, {result.unchanged} unchanged"
    if result.removed:
        counts += f", {result.removed} removed"
    say(f"{counts} in {result.sessions} session(s) of [b]{dataset}[/b]")
    for remark_type, colour in REMARK_COLOURS.items():
        for name, reason in shortened(result.remarks[remark_type], everything=everything):
            say(f"[{colour}]{remark_type}[/{colour}] {escape(f'{name}: {reason}')}")


def show_summary(paths: Paths, spec: DatasetSpec, *, known: bool) -> bool:
    """Print the settings, counts and label issues of an imported data set, and the next command.

    `known` is whether the data set existed before the import. Returns whether grasps or classes are
    ambiguous, or a cell of a target is not a number.
    """
    from ajgdata.pipeline.label_counts import label_counts
    from ajgdata.pipeline.label_issues import (
        cells_without_value,
        impossible_tasks,
        label_issues,
        label_tables,
    )

    file = escape(str(paths.dataset(spec.name)))
    tables = label_tables(paths, spec.name)
    issues = label_issues(tables, spec)
    if known:
        say(f"as declared before in {file}")
        print_facts(label_counts(tables, spec.label_targets))
        issues += cells_without_value(tables, spec)
    else:  # the import has already listed cells without a value
        targets = ", ".join(spec.targets) or "none"
        source = "features of a table"
        if spec.features.needs_waveform:
            source = f"{spec.audio.sample_rate_hz} Hz, {_channel(spec.audio.microphone)}"
        say(f"now declared in {file}: {source}, targets {targets}")
        print_facts(label_counts(tables, spec.label_targets))
        added = "the CNN too, add `cnn`" if spec.features.needs_waveform else "others, add `forest`"
        say(f"models: linear and k-NN; to train {added} to `models` of a task")
    for issue in issues:
        say(f"[yellow]warning[/yellow] {escape(issue.problem)}; {issue.fix}")
    if len(impossible_tasks(tables, spec)) < len(spec.tasks):
        say(f"next: ajgdata check {spec.name}, then ajgdata run {spec.name}")
    else:
        say(f"next: ajgdata check {spec.name} (no task of this data set is possible yet)")
    codes = {"mixed_grasp", "repeated_sample", "grasp_spelling", "similar_classes", "bad_label"}
    return any(issue.code in codes for issue in issues)


def _channel(microphone: Microphone) -> str:
    """Return the setting `microphone` of a data set in words."""
    if microphone is None:
        return "one microphone"
    if microphone == "mean":
        return "mean of the microphones"
    return microphone_text(microphone)
