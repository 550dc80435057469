"""Rows of imported tables, which are recordings without a waveform: their features and copies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ajgdata.features.compute import FeatureComputer
from ajgdata.store.audio import AudioError
from ajgdata.store.features import FeatureRows
from ajgdata.store.files import sha256_of
from ajgdata.store.findings import is_rejected, rejected, without_rejected
from ajgdata.store.labels import bad_labels, comparable_labels, copies, take_rows
from ajgdata.store.session_audio import AudioFile, SessionAudio
from ajgdata.types import DataError, DatasetSpec, Finding

#: Fewest columns of a table in which equal rows are copies: rows of a few rounded numbers can be
#: equal by chance.
FEWEST_COLUMNS = 16


def examine_row(
    session: str, file: AudioFile, computer: FeatureComputer
) -> tuple[np.ndarray | None, tuple[Finding, ...]]:
    """Return the feature (columns,), float32, of a row of an imported table, and its issues.

    The feature is None if the row cannot be used.
    """
    names = (session, file.recording_id, file.path.name)
    if file.table_row is None:
        fix = "import recordings into a data set of their own, and remove this session"
        problem = "is a sound file, but the features of this data set are columns of a table"
        return None, (Finding(*names, "error", "no_table_row", problem, fix),)
    try:
        return computer.from_table(file.table_row).values, ()
    except AudioError as error:
        issue = Finding(*names, "error", error.remark.code, error.problem, error.fix)
        return None, (issue,)
    except DataError as error:
        return None, (Finding(*names, "error", "no_feature", error.problem, error.fix),)
    except ValueError as error:
        fix = "correct the table and import it again, or remove the column from features.columns"
        return None, (Finding(*names, "error", "no_feature", str(error), fix),)


def equal_rows(
    recordings: Sequence[str], values: np.ndarray, labels: Sequence[tuple[str, ...]]
) -> dict[int, Finding]:
    """Return issues, by row, of `recordings` with equal `values` (n, columns), as `labels.copies`.

    Tables with fewer than FEWEST_COLUMNS are not searched.
    """
    if values.shape[1] < FEWEST_COLUMNS:
        return {}
    digests = [sha256_of(row.tobytes()) for row in values]
    return copies(recordings, digests, labels, "values")


def without_equal_rows(
    table: FeatureRows, targets: Sequence[str]
) -> tuple[FeatureRows, list[Finding]]:
    """Return the recordings without copies of others, and the issues of the copies."""
    names = [str(name) for name in table.columns["recording"].values]
    columns = [table.columns[name].values for name in targets if name in table.columns]
    labels = [tuple(str(column[row]) for column in columns) for row in range(len(names))]
    issues = equal_rows(names, table.feature, labels)
    keep = np.asarray([row for row in range(len(names)) if row not in issues], int)
    return take_rows(table, keep), list(issues.values())


def table_issues(
    sessions: Sequence[SessionAudio], spec: DatasetSpec, computer: FeatureComputer
) -> list[Finding]:
    """Return the issues of the values and labels of all rows of a data set without waveforms."""
    targets = spec.label_targets
    issues: list[Finding] = []
    names: list[str] = []
    features: list[np.ndarray] = []
    labels: list[tuple[str, ...]] = []
    for session in sessions:
        name = session.session_id
        rows = {row["recording_id"]: row for row in session.labels}
        own = [*session.findings]
        for file in session.files:
            values, problems = examine_row(name, file, computer)
            own += problems
            row = rows[file.recording_id]
            if values is not None and not is_rejected(row):
                names.append(f"{name}/{file.recording_id}")
                features.append(values)
                labels.append(comparable_labels(row, targets))
        for recording_id, row in rows.items():
            own += bad_labels(name, recording_id, row, targets)
        issues += without_rejected(own, list(rejected(name, rows).values()))
    if names:
        issues += equal_rows(names, np.asarray(features), labels).values()
    return issues
