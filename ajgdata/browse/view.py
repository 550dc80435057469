"""What the page of `ajgdata browse` shows, as values for JSON, and the decisions of people.

Tables of sessions and results of runs are read again if their files changed, so an open page shows
the changes of another page, of a person and of a run. Only `View.change` changes something: it adds
a line to the change log of a session.
"""

from __future__ import annotations

import base64
import threading
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.browse.features import ClassCurves, Features, novelty
from ajgdata.browse.predictions import (
    EmbeddingPlane,
    HeldOutPredictions,
    PredictionChoice,
    prediction_choices,
    read_model_predictions,
    read_planes,
)
from ajgdata.browse.query import Column, NumberColumn, matching, ordered, parse_filter
from ajgdata.browse.recordings import RecordingTable, TableReader
from ajgdata.browse.sounds import (
    Channel,
    level_dbfs,
    peaks,
    read_channel,
    spectrogram,
    wav_bytes,
)
from ajgdata.browse.table import (
    cells,
    label_texts,
    table_columns,
    target_of,
    with_feature_columns,
)
from ajgdata.paths import Paths
from ajgdata.pipeline.labelling import (
    change_recording,
    check_changeable,
    label_columns_of,
    recording_state,
)
from ajgdata.pipeline.review import Review, review_list
from ajgdata.store.feature_array import COLUMN, FREQUENCY
from ajgdata.store.features import read_store
from ajgdata.store.sessions import read_dataset
from ajgdata.types import WHOLE, WHOLE_FILE, DataError, Session
from ajgdata.types.change import ACTIONS
from ajgdata.types.session import SIMULATED_SOURCES

#: Columns that are computed from all features when the page first needs them.
FEATURE_COLUMNS = ("novelty", "x", "y")
#: Column of the review list, which is computed when a filter or an order first uses it.
SUSPICION = "suspicion"
#: Largest number of texts that are proposed for a label.
MAX_PROPOSED = 500
#: Name of the plane of the principal components of the features.
COMPONENTS = "features"
_NO_PREDICTIONS = HeldOutPredictions({}, {})


@dataclass(eq=False)
class Snapshot:
    """The recordings at one time, and what was computed from them."""

    version: int
    tables: object  #: state of the tables of labels and issues
    results: object  #: state of the files of results
    recordings: RecordingTable
    #: Columns by the name of the predictions.
    columns: dict[str, dict[str, Column]] = field(default_factory=dict)
    #: FEATURE_COLUMNS by the name of the plane.
    of_features: dict[str, dict[str, Column]] = field(default_factory=dict)
    #: Curves of the classes of a task.
    curves: dict[str, ClassCurves] = field(default_factory=dict)


class View:
    """The recordings of one data set. All methods can be called from several threads.

    The argument `choice` names predictions (`PredictionChoice.name`), and `plane` a plane; "" is
    the first one.
    """

    def __init__(self, paths: Paths, dataset: str, *, check: bool = False) -> None:
        self._paths = paths
        self.spec = read_dataset(paths, dataset)
        self._reader = TableReader(paths, self.spec, check=check)
        self._lock = threading.RLock()
        self._snapshot: Snapshot | None = None
        self._features: Features | None = None
        self._no_features = ""
        self._review: Review | None = None
        self._choices: dict[str, PredictionChoice] = {}
        self._planes: dict[str, EmbeddingPlane] = {}
        self.snapshot()  # errors of tables are errors of the command

    def snapshot(self) -> Snapshot:
        """Return the recordings and results; they are read again if a file changed."""
        with self._lock:
            tables = self._reader.state()
            results = self._results_state()
            last = self._snapshot
            if last is None or (last.tables, last.results) != (tables, results):
                if last is None or last.results != results:
                    self._read_results()
                version = 0 if last is None else last.version + 1
                last = Snapshot(version, tables, results, self._reader.read())
                self._snapshot = last
            return last

    def _results_state(self) -> object:
        """Return a value that differs after a change of the results of the data set."""
        name = self.spec.name
        choices = prediction_choices(self._paths, self.spec)
        files = [self._paths.features(name), *(choice.file for choice in choices)]
        return tuple((str(f), f.stat().st_mtime_ns) for f in files if f.is_file())

    def _read_results(self) -> None:
        """Read the names of predictions and planes; features are read when they are needed."""
        choices = prediction_choices(self._paths, self.spec)
        if not choices:
            choices = [PredictionChoice(task, "", Path()) for task in self.spec.tasks]
        self._choices = {choice.name: choice for choice in choices}
        self._planes = read_planes(self._paths, self.spec)
        self._features = None
        self._no_features = ""
        self._review = None

    def _choice(self, name: str) -> PredictionChoice:
        """Return predictions by name; the first for "", and none if there are no tasks.

        Raises DataError for an unknown name.
        """
        if not name:
            return next(iter(self._choices.values()), PredictionChoice("", "", Path()))
        if name not in self._choices:
            known = ", ".join(self._choices) or "none"
            raise DataError("--predictions", f"there is no {name!r}", f"use one of {known}")
        return self._choices[name]

    def features(self) -> Features | None:
        """Return the features of the last run; None if there are none, for the reason
        `about()["no_features"]`."""
        with self._lock:
            if self._features is None and not self._no_features:
                file = self._paths.features(self.spec.name)
                try:
                    self._features = Features(read_store(file))
                except DataError as error:
                    self._no_features = f"{error.problem}; {error.fix}"
            return self._features

    def columns(self, choice: str, plane: str, used: Collection[str] = ()) -> Mapping[str, Column]:
        """Return all columns.

        FEATURE_COLUMNS and SUSPICION take time: they are empty before they are first `used`.
        """
        return self._columns(self.snapshot(), choice, plane, used)

    def _columns(
        self, snapshot: Snapshot, choice: str, plane: str, used: Collection[str] = ()
    ) -> Mapping[str, Column]:
        """Return all columns of a snapshot, as `columns` does.

        A request uses one snapshot, because the numbers of recordings can differ in the next one.
        """
        with self._lock:
            chosen = self._choice(choice)
            if chosen.name not in snapshot.columns:
                predictions = _NO_PREDICTIONS
                if chosen.model:
                    predictions = read_model_predictions(chosen, self.spec.name)
                snapshot.columns[chosen.name] = table_columns(
                    snapshot.recordings, chosen.task, predictions
                )
            columns = snapshot.columns[chosen.name]
            empty = NumberColumn(np.full(len(snapshot.recordings.names), np.nan))
            added: dict[str, Column] = {}
            if self._paths.features(self.spec.name).is_file() or self._planes:
                if plane not in snapshot.of_features and not {*FEATURE_COLUMNS}.isdisjoint(used):
                    snapshot.of_features[plane] = self._feature_columns(snapshot, plane)
                added |= snapshot.of_features.get(plane, dict.fromkeys(FEATURE_COLUMNS, empty))
            if self.spec.tasks:
                if self._review is None and SUSPICION in used:
                    self._review = review_list(self._paths, self.spec.name)
                added[SUSPICION] = self._suspicion(snapshot) if self._review else empty
            return with_feature_columns(columns, added)

    def _suspicion(self, snapshot: Snapshot) -> Column:
        """Return the suspicion of recordings that people have not decided on.

        The review list is that of the last run: it is not computed again after each decision.
        """
        recordings = snapshot.recordings
        values = np.full(len(recordings.names), np.nan)
        for item in self._review.items if self._review else ():
            number = recordings.number.get(item.recording)
            if number is not None and not recordings.decisions[number].state:
                values[number] = item.suspicion
        return NumberColumn(values)

    def _feature_columns(self, snapshot: Snapshot, plane: str) -> dict[str, Column]:
        """Return novelty and coordinates of all recordings."""
        names = snapshot.recordings.names
        values = np.full((len(names), 3), np.nan)
        features = self.features()
        if features is not None:
            grasp_of = dict(zip(names, snapshot.recordings.grasps(), strict=True))
            grasps = [grasp_of.get(name, name) for name in features.names]
            own = novelty(features.points, grasps)
            _scatter(values[:, :1], snapshot.recordings, features.names, own[:, np.newaxis])
        name = self._plane_name(plane)
        if name in self._planes:
            points = self._planes[name].points
            _scatter(values[:, 1:], snapshot.recordings, points, np.array([*points.values()]))
        elif features is not None:
            _scatter(values[:, 1:], snapshot.recordings, features.names, features.plane)
        return {
            name: NumberColumn(column)
            for name, column in zip(FEATURE_COLUMNS, values.T, strict=True)
        }

    def _plane_name(self, plane: str) -> str:
        """Return the name of a plane. Raises DataError for an unknown name."""
        names = [*self._planes, COMPONENTS]
        if plane and plane not in names:
            raise DataError("plane", f"there is no {plane!r}", f"use one of {', '.join(names)}")
        return plane or names[0]

    def about(self) -> dict[str, Any]:
        """Return the facts about the data set, and what can be chosen."""
        snapshot = self.snapshot()
        sessions = snapshot.recordings.sessions.values()
        sources = {session.about.source for session in sessions if session.about is not None}
        is_simulated = bool(sources & SIMULATED_SOURCES)
        return {
            "dataset": self.spec.name,
            "title": self.spec.title or self.spec.name,
            "source": "simulated" if is_simulated else "recorded",
            "recordings": len(snapshot.recordings.names),
            "predictions": [
                {"name": name, "has_model": bool(choice.model)}
                for name, choice in self._choices.items()
            ],
            "planes": [
                *({"name": name, "title": plane.title} for name, plane in self._planes.items()),
                {"name": COMPONENTS, "title": "features, first two principal components"},
            ],
            "without_issues": snapshot.recordings.without_issues,
            "read_only": self._read_only(),
            "label_columns": {
                column: sorted(set(snapshot.recordings.texts(column)) - {""})[:MAX_PROPOSED]
                for column in label_columns_of(self.spec)
            },
            "general": [asdict(issue) for issue in snapshot.recordings.general],
        }

    def _read_only(self) -> str:
        """Return why labels cannot be changed; "" if they can."""
        try:
            check_changeable(self._paths, self.spec.name)
        except DataError as error:
            return f"{error.problem}; {error.fix}"
        return ""

    def change(
        self,
        recording: str,
        action: str,
        *,
        column: str = "",
        value: str = "",
        reason: str = "",
        version: str | None = None,
    ) -> str:
        """Write a decision about a recording (see `change_recording`), and return it in words.

        Raises DataError as `change_recording` does, and for an unknown action.
        """
        if action not in ACTIONS:
            raise DataError("action", f"there is no {action!r}", f"use one of {', '.join(ACTIONS)}")
        change = change_recording(
            self._paths,
            self.spec.name,
            recording,
            action,
            column=column,
            value=value,
            reason=reason,
            version=version,
        )
        return str(change)

    def table(self, choice: str, plane: str, text: str, sort: str) -> dict[str, Any]:
        """Return the numbers of the recordings that match a filter, in an order, and the columns.

        Raises DataError for a filter or an order that is wrong.
        """
        used = {condition.column for condition in parse_filter(text)} | {sort.removeprefix("-")}
        snapshot = self.snapshot()
        columns = self._columns(snapshot, choice, plane, used)
        count = len(snapshot.recordings.names)
        rows = np.flatnonzero(matching(columns, text, count))
        return {
            "version": snapshot.version,
            "order": ordered(columns, rows, sort).tolist(),
            "total": count,
            "remarks": list(self._review.remarks) if self._review and SUSPICION in used else [],
            "columns": [
                {
                    "name": name,
                    "unit": column.unit if isinstance(column, NumberColumn) else "",
                    "is_number": isinstance(column, NumberColumn),
                }
                for name, column in columns.items()
                if name not in ("x", "y")
            ],
        }

    def rows(self, choice: str, plane: str, numbers: list[int]) -> dict[str, Any]:
        """Return the cells of recordings by number; unknown numbers are omitted."""
        snapshot = self.snapshot()
        columns = self._columns(snapshot, choice, plane)
        known = [number for number in numbers if 0 <= number < len(snapshot.recordings.names)]
        return {
            "version": snapshot.version,
            "rows": {number: self._row(snapshot, columns, number) for number in known},
        }

    def _row(
        self, snapshot: Snapshot, columns: Mapping[str, Column], number: int
    ) -> dict[str, Any]:
        """Return the cells of a recording and the level of its worst issue."""
        issues = snapshot.recordings.issues.get(snapshot.recordings.names[number], ())
        return {"cells": cells(columns, number), "level": issues[0].level if issues else ""}

    def points(self, choice: str, plane: str) -> dict[str, Any]:
        """Return the coordinates of all recordings in a plane, null without coordinates, and the
        number of their class."""
        snapshot = self.snapshot()
        columns = self._columns(snapshot, choice, plane, FEATURE_COLUMNS)
        if "x" not in columns:
            return {"version": snapshot.version, "x": [], "y": [], "classes": [], "class": []}
        labels = label_texts(snapshot.recordings, self._choice(choice).task)
        classes, number = np.unique(np.asarray(labels, np.str_), return_inverse=True)
        return {
            "version": snapshot.version,
            "plane": self._plane_name(plane),
            **{name: _plain(columns[name].keys) for name in ("x", "y")},
            "classes": classes.tolist(),
            "class": number.tolist(),
        }

    def recording(self, choice: str, plane: str, name: str, channel: int = 1) -> dict[str, Any]:
        """Return everything about one recording. Raises DataError for an unknown name.

        A sound that cannot be read is null, and `problem` has the reason.
        """
        # A decision between state and snapshot is a conflict; the other order would hide it.
        state = self._state(name)
        snapshot = self.snapshot()
        number = self._number(snapshot, name)
        session = name.partition("/")[0]
        about = snapshot.recordings.sessions[session].about
        recordings = snapshot.recordings
        content: dict[str, Any] = {
            "name": name,
            "number": number,
            "version": snapshot.version,
            "file": str(recordings.sounds[number].path or ""),
            "issues": [asdict(issue) for issue in recordings.issues.get(name, ())],
            "of_session": [
                asdict(issue)
                for issue in recordings.general
                if issue.session_id in (session, WHOLE)
            ],
            "session": _about_session(session, about),
            "state": state,
            "target": target_of(self.spec, self._choice(choice).task)[0],
            "reasons": self._reasons(name),
            "sound": None,
            "problem": "",
            **self._row(snapshot, self._columns(snapshot, choice, plane), number),
        }
        if recordings.sounds[number].path is None:
            content["problem"] = recordings.sounds[number].without
        else:
            try:
                content["sound"] = _sound(self._channel(snapshot, name, channel))
            except DataError as error:
                content["problem"] = f"{error.problem}; {error.fix}"
        content["spectrum"] = self._spectrum(snapshot, self._choice(choice).task, name)
        return content

    def _state(self, name: str) -> dict[str, Any] | None:
        """Return the decisions about a recording; None if its row cannot be read."""
        try:
            state = recording_state(self._paths, self.spec.name, name)
        except DataError:
            return None  # the issues of the recording have the reason
        return {
            "version": state.version,
            "changed": dict(state.changed),
            "labels": {
                column: state.labels.get(column, "") for column in label_columns_of(self.spec)
            },
            "history": [str(change) for change in state.history],
        }

    def _reasons(self, name: str) -> list[str]:
        """Return why the label of a recording is suspicious, if the review list is known."""
        items = self._review.items if self._review else ()
        return [reason for item in items if item.recording == name for reason in item.reasons]

    def _spectrum(self, snapshot: Snapshot, task: str, name: str) -> dict[str, Any]:
        """Return the curve of a recording with those of classes, or the reason for none."""
        features = self.features()
        if features is None:
            return {"note": f"The features are missing: {self._no_features}."}
        if name not in features.row:
            return {"note": "The last run used no features of this recording."}
        with self._lock:
            if task not in snapshot.curves:
                labels = label_texts(snapshot.recordings, task)
                number = snapshot.recordings.number
                of_rows = [labels[number[n]] if n in number else "" for n in features.names]
                snapshot.curves[task] = ClassCurves(features.curves, of_rows)
        compared = snapshot.curves[task].compared(features.row[name])
        axis = features.axis
        lines = [("own", "this recording", compared.own)]
        if compared.of_label is not None:
            lines.append(("class", f"mean of {compared.label} (others)", compared.of_label))
        if compared.of_nearest is not None:
            title = f"mean of {compared.nearest}, the nearest other class"
            lines.append(("other", title, compared.of_nearest))
        return {
            "note": "",
            "axis": axis.name,
            "unit": axis.attrs.get("units", ""),
            "x": _plain(np.arange(len(axis.values)) if axis.name == COLUMN else axis.values),
            "lines": [
                {"role": role, "title": title, "y": _plain(values)} for role, title, values in lines
            ],
            "is_positive": axis.name == FREQUENCY and bool(compared.own.min() >= 0),
        }

    def sound(self, name: str, channel: int) -> bytes:
        """Return a channel of a recording as a WAV file. Raises DataError if it cannot be read."""
        return wav_bytes(self._channel(self.snapshot(), name, channel))

    def played(self, session: str) -> bytes:
        """Return the played sound of a session as a WAV file. Raises DataError without one."""
        sessions = self.snapshot().recordings.sessions
        path = sessions[session].played if session in sessions else None
        if path is None:
            raise DataError(session, "has no played sound", "choose another session")
        return wav_bytes(read_channel(path, WHOLE_FILE))

    def _channel(self, snapshot: Snapshot, name: str, channel: int) -> Channel:
        """Return a channel of a recording. Raises DataError if it cannot be read."""
        sound = snapshot.recordings.sounds[self._number(snapshot, name)]
        if sound.path is None:
            raise DataError(name, sound.without, "choose another recording")
        return read_channel(sound.path, sound.segment, channel)

    def _number(self, snapshot: Snapshot, name: str) -> int:
        """Return the number of a recording. Raises DataError for an unknown name."""
        number = snapshot.recordings.number.get(name)
        if number is None:
            raise DataError(self.spec.name, f"there is no recording {name!r}", "reload the page")
        return number


def _about_session(name: str, session: Session | None) -> dict[str, str]:
    """Return the facts about a session; only its name if it cannot be read."""
    if session is None:
        return {"name": name}
    played = session.excitation
    return {
        "name": name,
        "notes": session.notes,
        "played": "" if played is None else played.description or played.file,
        "gripper": session.gripper,
        "medium": session.medium,
        "device": session.device,
    }


def _sound(channel: Channel) -> dict[str, Any]:
    """Return a channel with its waveform and its spectrogram.

    The levels of the spectrogram are bytes in base64, row by row, the lowest frequency first.
    """
    info = channel.info
    drawn = spectrogram(channel.samples, info.sample_rate_hz)
    low, high = peaks(channel.samples)
    return {
        "channel": channel.number,
        "channels": info.channels,
        "rate_hz": info.sample_rate_hz,
        "seconds": len(channel.samples) / info.sample_rate_hz,
        "encoding": f"{info.format} {info.subtype}",
        "peak_dbfs": level_dbfs(channel.samples),
        "low": _plain(low),
        "high": _plain(high),
        "spectrogram": {
            "rows": drawn.levels.shape[0],
            "columns": drawn.levels.shape[1],
            "levels": base64.b64encode(drawn.levels.tobytes()).decode(),
            "low_hz": drawn.low_hz,
            "high_hz": drawn.high_hz,
        },
    }


def _scatter(
    into: np.ndarray, recordings: RecordingTable, names: Iterable[str], values: np.ndarray
) -> None:
    """Write values (m, k) of recordings by name to their rows of `into` (n, k)."""
    rows = np.array([recordings.number.get(name, -1) for name in names], int)
    into[rows[rows >= 0]] = values[rows >= 0]


def _plain(values: np.ndarray) -> list[float | None]:
    """Return numbers for JSON, with five digits; NaN becomes None."""
    return [
        None if np.isnan(value) else float(f"{value:.5g}") for value in np.asarray(values, float)
    ]
