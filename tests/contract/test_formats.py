"""Each format has a version, a history and a command, and the documentation lists them."""

import ast
from pathlib import Path
from typing import get_args

import pytest

from ajgdata.store.code_hash import sources
from ajgdata.types import DatasetSpec, Session
from ajgdata.types.formats import DATASET_FORMAT, FORMATS, SESSION_FORMAT, FileFormat, FormatError

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("file_format", FORMATS, ids=lambda file_format: file_format.files)
def test_a_format_with_earlier_versions_names_the_command_that_brings_files_to_the_last(
    file_format,
):
    assert file_format.is_result or file_format.renewal or file_format.version == 1
    assert all(file_format.history)


def test_the_documentation_lists_the_versions():
    rows = ["| files | version | place of the version | content |", "|---|---|---|---|"]
    rows += [
        f"| {item.files} | {item.version} | {item.place} | {item.history[-1]} |" for item in FORMATS
    ]
    page = (ROOT / "docs/data-model.md").read_text(encoding="utf-8")
    assert "\n".join(rows) in page, "\n".join(rows)


@pytest.mark.parametrize(
    ("model", "file_format"), [(DatasetSpec, DATASET_FORMAT), (Session, SESSION_FORMAT)]
)
def test_the_settings_allow_only_the_version_of_this_package(model, file_format):
    field = model.model_fields["format"]
    assert field.default == file_format.version
    assert get_args(field.annotation) == (file_format.version,)


TWO = FileFormat("things", "key", ("one", "two"), renewal="run `ajgdata convert mine`")


@pytest.mark.parametrize(
    ("stated", "line"),
    [
        (
            None,
            "x: format 1 is of an earlier version of ajgdata; this version of ajgdata reads "
            "format 2. Run `ajgdata convert mine`.",
        ),
        (
            3,
            "x: format 3 is of a later version of ajgdata; this version of ajgdata reads "
            "format 2. Update ajgdata.",
        ),
        (
            -1,
            "x: format = -1 is not a version; this version of ajgdata reads format 2. "
            "Correct the value.",
        ),
    ],
)
def test_files_of_other_versions_are_refused(stated, line):
    with pytest.raises(FormatError) as refused:
        TWO.check("x", stated)
    assert str(refused.value) == line
    TWO.check("x", 2)


@pytest.mark.parametrize(
    ("job_type", "name"),
    [
        ("features", "FEATURES_FORMAT"),
        ("embed", "LATENTS_FORMAT"),
        ("train", "MODEL_FORMAT"),
        ("experiment", "TABLES_FORMAT"),
        ("study", "TABLES_FORMAT"),
        ("collect", "METRICS_FORMAT"),
    ],
)
def test_results_depend_on_the_version_of_their_format(job_type, name):
    """So a run computes results of another version again."""
    (source,) = (s for s in sources(job_type) if s.file.name == "formats.py" and name in s.names)
    assert f"{name} = FileFormat" in "\n".join(map(ast.unparse, source.statements()))
