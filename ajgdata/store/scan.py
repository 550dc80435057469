"""Scan of a folder of recordings: session, grasp and labels of each file, by pattern or by table.

This is the only module that reads labels from file names.
"""

from __future__ import annotations

import functools
import os
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from types import MappingProxyType

from ajgdata.paths import SESSION_FILE
from ajgdata.store.audio import AudioError, inspect_audio
from ajgdata.store.counters import joined_spellings, whole_number
from ajgdata.store.file_matching import LOOSEST_STEP, find_files
from ajgdata.store.file_names import unused_parts
from ajgdata.store.file_segments import FilePart, cut_by_period, cut_track, take_segment
from ajgdata.store.files import plain_text
from ajgdata.store.label_table import read_label_table, visible
from ajgdata.store.listing import listed
from ajgdata.store.name_pattern import compile_pattern, match_name
from ajgdata.store.session_names import KnownSession, is_changed, slug, stored_session_names
from ajgdata.store.starter_kit import STARTER_KIT
from ajgdata.store.time_join import join_by_time
from ajgdata.types import (
    NAME_PATTERN,
    WHOLE_FILE,
    DataError,
    ImportSettings,
    JoinSettings,
    Segment,
    SegmentSettings,
    checked_name,
    is_reserved,
    many,
)

#: Suffixes of audio files. FFmpeg (extra `audio`) reads the last three, libsndfile the others.
AUDIO_SUFFIXES = {
    ".wav",
    ".wave",
    ".flac",
    ".ogg",
    ".oga",
    ".opus",
    ".mp3",
    ".aif",
    ".aiff",
    ".au",
    ".caf",
    ".m4a",
    ".aac",
    ".wma",
}
#: File names without a pattern, if their labels are in label tracks: only the number 0 of a played
#: sound has a meaning.
ANY_NAME = r"(?:.*/)?(?:(?P<n>0+)_)?[^/]+"
#: Group of a pattern that is not empty for the played sound of a session.
PLAYED = "played"
#: Role of a column or group with this name in lower case. All other columns and groups are labels.
ROLES = {
    "recording_id": "recording_id",
    "grasp": "grasp",
    "grasp_id": "grasp_id",
    "object": "object",
    "sample": "sample",
    "placement": "placement",
    "placement_id": "placement_id",
    "quality": "quality",
    "session": "session",
    "session_id": "session",
}
#: Remark about a part of file names that the pattern does not use.
UNUSED_PART = (
    "differ between files in a part that the pattern does not use. Name this part, e.g. "
    r"(?P<grasp>\d+), or (?P<take>.+) for a part that is stored and not learnt"
)
#: Names and reasons by type, e.g. `failed`.
Remarks = defaultdict[str, list[tuple[str, str]]]
#: Texts of the columns or groups of each file, and of each recording.
RowsByFile = dict[Path, dict[str, str]]
Rows = dict[FilePart, dict[str, str]]


@dataclass(frozen=True)
class ScannedFile:
    """One recording in the folder: its path relative to the folder, session, cells and labels.

    A recording is a file or a `segment` of it.

    `cells` are texts of `grasp_id`, `placement_id`, `object`, `recording_id`, `sample` and
    `quality`; "" if the folder does not specify them. `has_grasp` is True if the folder specifies
    the grasp, `has_grasp_number` if the grasp is a number within the object, and `has_grasp_parts`
    if the texts between `/` are from several columns.
    """

    path: Path
    session: str
    cells: Mapping[str, str]
    labels: Mapping[str, str]
    has_grasp: bool = False
    has_grasp_number: bool = False
    has_grasp_parts: bool = False
    segment: Segment = WHOLE_FILE

    def text(self, column: str) -> str:
        """Return the text of a label or of `object`."""
        return self.cells["object"] if column == "object" else self.labels.get(column, "")


@dataclass
class Scan:
    """Recordings of a folder, and remarks: names and reasons by type.

    - `failed`: files of recordings that cannot be imported
    - `unused`: parts of file names that vary and that the pattern does not use
    - `not used`: all other files
    - `warning` and `note`: other remarks
    """

    folder: Path
    files: list[ScannedFile] = field(default_factory=list)
    remarks: Remarks = field(default_factory=lambda: defaultdict(list))
    is_simulated: bool = False
    #: Named groups of each played sound, by path, and the played sounds by session.
    played_rows: RowsByFile = field(default_factory=dict)
    played: defaultdict[str, list[Path]] = field(default_factory=lambda: defaultdict(list))
    #: Text of each session in the folder or table, by name, and the template of these texts;
    #: the template is "" if the session is the folder.
    session_texts: dict[str, str] = field(default_factory=dict)
    session_template: str = ""

    def label_columns(self) -> list[str]:
        """Return the columns that are labels of recordings."""
        return list(self.files[0].labels)


def scan(
    folder: Path,
    settings: ImportSettings,
    name: str,
    known: Mapping[str, KnownSession] = MappingProxyType({}),
) -> Scan:
    """Return all recordings below `folder`, sorted by path, by `settings.pattern` or `.table`.

    `name` is the session of recordings without a session, and `known` are the sessions of the data
    set. Raises DataError if the folder, the pattern or the table cannot be used, or if no file
    matches.
    """
    name = plain_text(name)
    if not folder.is_dir():
        raise DataError(folder, "is not a folder", "name the folder that holds the recordings")
    result = Scan(folder)
    audio, result.remarks["not used"] = search(folder)
    if not audio:
        raise DataError(folder, "holds no audio files", "name a folder with .wav, .flac or .ogg")
    rows = _read_rows(audio, settings, name, result)
    add_rows(result, rows, settings, name, known, have_files=True)
    if not result.files:
        examples = [*result.remarks["failed"], *result.remarks["not used"]]
        example = ": {!r} {}".format(*examples[0]) if examples else ""
        fix = "correct --pattern or --file (the whole path inside the folder)"
        raise DataError(folder, f"none of its audio files can be imported{example}", fix)
    return result


def add_rows(
    result: Scan,
    rows: Rows,
    settings: ImportSettings,
    name: str,
    known: Mapping[str, KnownSession],
    *,
    have_files: bool,
) -> None:
    """Add the recordings of `rows` to a scan, with their sessions, grasps and labels.

    `name` and `known` are those of `scan`. `have_files` is False for rows of a table that are
    recordings without files.
    """
    columns = _columns(next(iter(rows.values()), {}), settings, result)
    sessions = [name for name, role in columns.items() if role == "session"]
    named_rows = []
    if settings.pattern or not settings.table:
        named_rows = [*rows.values(), *result.played_rows.values()]
    exact = _alike(named_rows, sessions)
    rows = {part: _plain(texts, sessions, exact) for part, texts in rows.items()}
    _note_empty_grasps(rows, columns, settings, result)
    _warn_of_empty_sessions(rows, result)
    numbered = _with_joined_numbers(rows, columns, settings, result)
    for part, texts in sorted(rows.items()):
        if not have_files or (result.folder / part.path).is_file():
            result.files.append(_scanned(part, texts, numbered[part], columns, settings, name))
        else:
            result.remarks["failed"].append((part.text, "not a file, or a broken link"))
    if settings.segments:
        _number_segments(result)
    for path, texts in result.played_rows.items():
        cells = _plain(texts, sessions, exact)
        session = _scanned(FilePart(path), cells, cells, columns, settings, name).session
        result.played[session].append(path)
    _use_stored_name(result, settings.session, known)
    _name_sessions(result, known)
    _note_grasps_without_object(result)
    numbers = _sample_numbers({file.cells["sample"] for file in result.files}, result)
    result.files = [
        replace(file, cells={**file.cells, "sample": numbers[file.cells["sample"]]})
        for file in result.files
    ]


def search(folder: Path) -> tuple[list[Path], list[tuple[str, str]]]:
    """Return the audio files below a folder, sorted and relative to it, and names and reasons of
    files and folders that are skipped.

    Hidden files and folders are ignored. Sessions of data sets and links to folders are not
    searched. Raises OSError for a folder that cannot be searched.
    """
    audio: list[Path] = []
    skipped: list[tuple[str, str]] = []
    for root, folders, names in os.walk(folder, onerror=_stop):
        parent = Path(root).relative_to(folder)
        folders[:] = [name for name in folders if not name.startswith(".")]
        if SESSION_FILE in names:
            skipped.append((parent.as_posix(), "a session of a data set, not searched"))
            folders.clear()
            continue
        links = [name for name in folders if Path(root, name).is_symlink()]
        reason = "a link to a folder, not searched: name that folder"
        skipped += [((parent / name).as_posix(), reason) for name in links]
        for path in (parent / name for name in names if not name.startswith(".")):
            if path.suffix.lower() not in AUDIO_SUFFIXES:
                continue
            if path.as_posix().isprintable():
                audio.append(path)
            else:
                skipped.append((ascii(path.as_posix()), "its name is not plain text: rename it"))
    copies = _copies_of_wavs(audio)
    reason = "probably the same sound as the WAV of its name"
    skipped += [(path.as_posix(), reason) for path in copies]
    return sorted(set(audio) - copies), sorted(skipped)


def _stop(error: OSError) -> None:
    """Raise the error of a folder that cannot be searched."""
    raise error


def _copies_of_wavs(audio: Iterable[Path]) -> set[Path]:
    """Return the files whose names differ from that of a WAV only by the suffix."""
    not_wav = {path for path in audio if path.suffix.lower() != ".wav"}
    if not not_wav:
        return set()
    names_of_wavs = {path.with_suffix("") for path in audio if path not in not_wav}
    return {path for path in not_wav if path.with_suffix("") in names_of_wavs}


def _read_rows(audio: list[Path], settings: ImportSettings, name: str, result: Scan) -> Rows:
    """Return the texts of each recording from the table or the pattern, from label tracks, and from
    joined tables."""
    if settings.table:
        rows = _by_table(result.folder, audio, settings, result)
        if settings.pattern:
            rows = _with_groups(rows, settings.pattern, result)
    else:
        of_files = _by_name(audio, settings, name, result)
        rows = {FilePart(path): texts for path, texts in of_files.items()}
    if settings.segments:
        rows = _cut(rows, settings.segments, result)
    if settings.join and rows:
        return _with_joined_columns(rows, settings.join, result, of_files=not settings.table)
    return rows


def _by_name(audio: list[Path], settings: ImportSettings, name: str, result: Scan) -> RowsByFile:
    """Return the named groups of each file that matches, by path."""
    takes_any = not settings.pattern and settings.segments is not None
    is_kit = settings.pattern in ("", "starter-kit")
    folders = {path.parent for path in audio}
    if is_kit and Path() in folders and Path(name) in folders and not settings.session:
        problem = f"its files and those of its folder {name!r} would be one session"
        fix = "rename that folder, or import both folders with --session"
        raise DataError(result.folder, problem, fix)
    form = ANY_NAME if takes_any else STARTER_KIT
    pattern = compile_pattern(form if is_kit else settings.pattern)
    rows = {}
    matches = []
    for path in audio:
        match = match_name(pattern, path.as_posix())
        if not match:
            result.remarks["not used"].append((path.as_posix(), "does not match the pattern"))
            continue
        texts = match.groupdict(default="")
        if is_kit:
            texts["session"] = path.parent.as_posix() if path.parent.name else name
        if takes_any:
            del texts["n"]
        if is_kit:
            is_played = bool(match["n"]) and int(match["n"]) == 0
        else:
            is_played = bool(texts.pop(PLAYED, ""))
        if is_played:
            result.remarks["not used"].append((path.as_posix(), "the played sound"))
            result.played_rows[path] = texts
        else:
            rows[path] = texts
            matches.append(match)
    if not is_kit:
        for part in unused_parts(matches):
            result.remarks["unused"].append((", ".join(map(repr, part[:4])), UNUSED_PART))
    return rows


def _named_rows(
    folder: Path, settings: ImportSettings, result: Scan
) -> list[tuple[str, Segment, dict[str, str]]]:
    """Return the path of the file, relative to `folder`, the segment, and the cells of each row of
    the tables. Times of segments are not cells.

    A column that a table lacks is empty in its rows, and noted. Raises DataError without a table.
    """
    is_one = "*" not in settings.table
    paths = [folder / settings.table] if is_one else sorted(folder.glob(settings.table))
    if not paths:
        problem = f"holds no table {settings.table!r}"
        raise DataError(folder, problem, "correct --table, relative to this folder")
    named = []
    tables_of: dict[str, list[str]] = defaultdict(list)
    for path in paths:
        table = read_label_table(path, template_columns(settings.file))
        result.remarks["note"] += table.notes
        parent = PurePosixPath(path.parent.relative_to(folder))
        for line, cells in table.rows:
            name = _filled("file", settings.file, cells)
            if not is_one:
                name = (parent / name).as_posix()
            named.append((f"{path}:{line}", name, cells))
        for column in table.rows[0][1] if table.rows else ():
            tables_of[column].append(path.relative_to(folder).as_posix())
    for column, tables in tables_of.items():
        if len(tables) < len(paths):
            reason = f"only in {listed(tables)}: empty in the recordings of other tables"
            result.remarks["note"].append((f"column {column}", reason))
    empty = dict.fromkeys(tables_of, "")
    rows = []
    for where, name, cells in named:
        others = {**empty, **cells}
        segment = WHOLE_FILE
        if settings.segments and settings.segments.labels == "table":
            segment, others = take_segment(where, others)
        rows.append((name, segment, others))
    return rows


def _with_groups(rows: Rows, text: str, result: Scan) -> Rows:
    """Return rows of a table with the named groups of the pattern `text` for their paths.

    A path that does not match has empty groups and a warning. Raises DataError for a group that is
    also a column.
    """
    pattern = compile_pattern(text)
    taken = [name for name in next(iter(rows.values()), {}) if name in pattern.groupindex]
    if taken:
        problem = f"group {taken[0]!r} is also a column of the table"
        raise DataError("--pattern", problem, "rename the group")
    named = {}
    for part, cells in rows.items():
        match = match_name(pattern, part.path.as_posix())
        if match is None:
            reason = "does not match the pattern, whose groups are empty"
            result.remarks["warning"].append((part.text, reason))
        groups = match.groupdict(default="") if match else dict.fromkeys(pattern.groupindex, "")
        named[part] = {**cells, **groups}
    return named


def _by_table(folder: Path, audio: list[Path], settings: ImportSettings, result: Scan) -> Rows:
    """Return the cells of each row of the table whose file is in the folder, by file and segment.

    A looser reading of a file name (see `file_matching.STEPS`) is a remark. If two rows name one
    file, it belongs to the row that names it more exactly. Raises DataError if both rows name it by
    the same step.
    """
    where = folder / settings.table
    named = _named_rows(folder, settings, result)
    matches = find_files({name for name, _, _ in named}, audio)
    rows: Rows = {}
    names: dict[Path, str] = {}
    looser: dict[str, list[str]] = defaultdict(list)
    missing = []
    for name, segment, cells in named:
        match = matches.get(name)
        if match is None:
            missing.append((visible(name), f"in {settings.table} but not in the folder"))
            continue
        if len(match.files) > 1:
            files = ", ".join(visible(path.as_posix()) for path in match.files)
            reason = f"in {settings.table}, and several files have this name without regard to"
            missing.append((visible(name), f"{reason} {match.step}: {files}; write the exact name"))
            continue
        path = match.files[0]
        if match.taken_by is not None:
            reason = (
                f"in {settings.table} but not in the folder; {visible(path.as_posix())} is the file"
                f" of the row {visible(match.taken_by)}"
            )
            missing.append((visible(name), reason))
            continue
        part = FilePart(path, segment)
        if part in rows:
            problem = f"{visible(part.text)} is in two rows"
            if names[path] != name:
                problem += f", as {visible(names[path])} and as {visible(name)}"
            raise DataError(where, problem, "keep one of them, with the exact name")
        is_first = path not in names
        rows[part] = cells
        names[path] = name
        if match.step and is_first:
            example = f"{visible(name)} (table) is {visible(path.as_posix())} (folder)"
            looser[match.step].append(example)
    for step, examples in looser.items():
        noun = "file name matches" if len(examples) == 1 else "file names match"
        counted = f"{len(examples)} {noun} only without regard to {step}"
        remark_type = "warning" if step == LOOSEST_STEP else "note"
        result.remarks[remark_type].append((counted, listed(examples)))
    result.remarks["failed"] += sorted(missing)
    unlisted = sorted(set(audio) - set(names))
    result.remarks["not used"] += [
        (visible(path.as_posix()), f"no row in {settings.table}") for path in unlisted
    ]
    return rows


def _with_joined_columns(
    rows: Rows, settings: JoinSettings, result: Scan, *, of_files: bool
) -> Rows:
    """Return rows with the columns of the table that is joined by time.

    The times in `rows` are those of recordings, or `of_files` that contain segments.
    A recording without a row of the table has empty cells and a warning. Raises DataError for a
    column that exists, and if no recording has a row.
    """
    option = "imports.join"
    names = list(next(iter(rows.values()), {}))
    if settings.recording_time not in names:
        problem = f"recording_time names {settings.recording_time!r}"
        raise DataError(option, problem, f"use one of {names}")
    times = {part: texts[settings.recording_time] for part, texts in rows.items()}
    joined = join_by_time(result.folder, times, settings, of_files=of_files)
    if not joined.cells:
        example = ": ".join(joined.missing[0])
        fix = "compare the clocks, time zones and tolerance_s"
        raise DataError(option, f"no recording has a row of {settings.table} ({example})", fix)
    columns = list(next(iter(joined.cells.values())))
    taken = [name for name in columns if name in names]
    if taken:
        problem = f"column {taken[0]!r} of {settings.table} is also a label of the recordings"
        raise DataError(option, problem, "list other columns under `columns`, or rename it")
    result.remarks["warning"] += joined.missing
    result.remarks["note"] += joined.notes
    empty = dict.fromkeys(columns, "")
    return {part: {**texts, **joined.cells.get(part, empty)} for part, texts in rows.items()}


def _cut(rows: Rows, settings: SegmentSettings, result: Scan) -> Rows:
    """Return a row for each segment of the files of `rows`.

    Files without a label track, and files that are shorter than a period, are remarks. A file that
    is not usable audio stays whole, and the import reports it.
    """
    cut: Rows = {}
    length_of = functools.cache(_length_s)  # many intervals of a table are of one file
    for part, texts in rows.items():
        if settings.labels == "track":
            if any(column.lower() == "label" for column in texts):
                problem = "`label` is in the label tracks and in the pattern or table"
                raise DataError("--segments", problem, "rename the group or column")
            track = (result.folder / part.path).with_suffix(".txt")
            if not track.is_file():
                reason = f"has no label track {track.name} next to it"
                result.remarks["failed"].append((part.text, reason))
                continue
            for segment, label in cut_track(track, settings):
                cut[FilePart(part.path, segment)] = {**texts, "label": label}
            continue
        if settings.period_s is None:
            cut[part] = texts
            continue
        segments = _periods(part, length_of(result.folder / part.path), settings)
        if not segments:
            result.remarks["failed"].append((part.text, "is shorter than --offset and --period"))
        cut.update({FilePart(part.path, segment): texts for segment in segments})
    return cut


def _length_s(path: Path) -> float | None:
    """Return the length of a file in s; None if it is not usable audio."""
    try:
        info = inspect_audio(path)
    except AudioError:
        return None
    return info.frames / info.sample_rate_hz


def _periods(part: FilePart, length_s: float | None, settings: SegmentSettings) -> list[Segment]:
    """Return the segments of a file with a length, or of an interval of it, by the period."""
    interval = part.segment
    if length_s is None:
        return [interval]
    return cut_by_period(Segment(interval.start_s, min(interval.end_s, length_s)), settings)


def _number_segments(result: Scan) -> None:
    """Give each segment a recording_id, a grasp and a number within the grasp, unless the folder
    specifies them.

    Successive segments of a file with one object are one grasp: only a change of the object shows
    that the gripper was opened, and sounds of one grasp are not independent.
    """
    counts = Counter(file.path for file in result.files)
    numbers: Counter[Path] = Counter()
    changes: Counter[Path] = Counter()
    objects: dict[Path, str] = {}
    samples: Counter[tuple[str, str]] = Counter()
    runs = set()
    files = []
    for file in result.files:
        if file.segment == WHOLE_FILE:
            files.append(file)
            continue
        numbers[file.path] += 1
        if objects.get(file.path) != file.cells["object"]:
            changes[file.path] += 1
            objects[file.path] = file.cells["object"]
        cells = dict(file.cells)
        if not file.has_grasp:
            cells["grasp_id"] = f"{file_id(file.path)}_{changes[file.path]}"
            runs.add(cells["grasp_id"])
        if not cells["recording_id"]:
            digits = len(str(counts[file.path]))
            cells["recording_id"] = f"{file_id(file.path)}_{numbers[file.path]:0{digits}}"
        if not cells["sample"]:
            grasp = (file.session, cells["grasp_id"])
            cells["sample"] = str(samples[grasp])
            samples[grasp] += 1
        files.append(replace(file, cells=cells))
    result.files = files
    counted = f"{many(numbers.total(), 'segment')} of {many(len(numbers), 'file')}"
    if runs:
        reason = f"{many(len(runs), 'grasp')}: successive segments of a file with one object"
        result.remarks["note"].append((counted, reason))


def file_id(path: Path) -> str:
    """Return the recording_id of a file: its path without suffix.

    Blanks at the ends become _, because the cells of a table lose them.
    """
    return re.sub(r"^\s+|\s+$", "_", path.with_suffix("").as_posix())


def _columns(texts: Mapping[str, str], settings: ImportSettings, result: Scan) -> dict[str, str]:
    """Return the role, or the name as a label, of each column that is stored.

    Raises DataError for two columns with one meaning.
    """
    columns = {name: ROLES.get(slug(name).lower(), slug(name)) for name in texts}
    meanings = list(columns.values())
    doubled = [meaning for meaning in meanings if meanings.count(meaning) > 1]
    if doubled:
        names = [name for name, meaning in columns.items() if meaning == doubled[0]]
        problem = f"columns {names} would all be {doubled[0]!r}"
        raise DataError(settings.table or "--pattern", problem, "rename all but one")
    if "sample" in meanings and not (settings.grasp or {"grasp", "grasp_id"} & set(meanings)):
        problem = "names `sample` without `grasp`: recordings of a grasp would be different grasps"
        fix = "name the grasp; if each file is one grasp, add --grasp with columns that identify it"
        raise DataError(settings.table or "--pattern", problem, fix)
    result.session_template = settings.session or next(
        (f"{{{name}}}" for name, meaning in columns.items() if meaning == "session"), ""
    )
    roles = set(ROLES.values())
    stored = {
        name: meaning
        for name, meaning in columns.items()
        if meaning in roles or (NAME_PATTERN.fullmatch(meaning) and not is_reserved(meaning))
    }
    unused = [columns[name] for name in columns if name not in stored]
    if unused:
        reason = "not stored, because no label can have these names"
        result.remarks["note"].append((reason, ", ".join(unused)))
    return stored


def _filled(option: str, template: str, cells: Mapping[str, str]) -> str:
    """Return a template such as '{Grasp no.}' with the cells of a row inserted."""
    try:
        return re.sub(r"\{([^{}]*)\}", lambda match: cells[match[1]], template)
    except KeyError as error:
        problem = f"{template!r} names {error.args[0]!r}"
        raise DataError(f"--{option}", problem, f"use one of {list(cells)}") from None


def _scanned(
    part: FilePart,
    texts: Mapping[str, str],
    numbered: Mapping[str, str],
    columns: dict[str, str],
    settings: ImportSettings,
    name: str,
) -> ScannedFile:
    """Return the recording of a row, with its session as in the folder.

    `numbered` are the texts with one spelling of each number of a grasp or sample; the spelling of
    labels does not change. A grasp number is a number within its object.
    """
    named = {columns[column]: text for column, text in texts.items() if column in columns}
    labels = {column: text for column, text in named.items() if column not in ROLES.values()}
    label = next((text for column, text in labels.items() if column.lower() == "label"), "")
    counters = {columns[column]: text for column, text in numbered.items() if column in columns}
    templates = {
        "object": settings.object,
        "session": settings.session,
        "placement_id": settings.placement,
    }
    filled = {role: _filled(role, text, texts) for role, text in templates.items() if text}
    if settings.grasp:
        filled["grasp"] = _filled_grasp(settings.grasp, numbered)
    object_name = (filled.get("object") or named.get("object", "")) or label
    number = counters.get("grasp", "")
    grasp = f"{object_name}/{number}" if object_name and number else number
    grasp_id = filled.get("grasp") or ("" if settings.grasp else counters.get("grasp_id", ""))
    cells = {
        "grasp_id": grasp_id or grasp or file_id(part.path),
        "placement_id": filled.get("placement_id") or _placement(named, object_name),
        "object": object_name,
        "recording_id": named.get("recording_id", ""),
        "sample": counters.get("sample", ""),
        "quality": named.get("quality", ""),
    }
    session = filled.get("session") or named.get("session", "") or name
    has_template = bool(settings.grasp and filled["grasp"])
    has_grasp_number = bool(grasp) and not grasp_id
    return ScannedFile(
        part.path,
        session,
        cells,
        labels,
        has_grasp=bool(grasp_id or grasp),
        has_grasp_number=has_grasp_number,
        has_grasp_parts=has_grasp_number or (has_template and "/" in settings.grasp),
        segment=part.segment,
    )


def _placement(named: Mapping[str, str], object_name: str) -> str:
    """Return the placement of a row; `placement` is a number within its object."""
    number = named.get("placement", "")
    own = f"{object_name}/{number}" if object_name and number else number
    return named.get("placement_id", "") or own


def template_columns(template: str) -> list[str]:
    """Return the columns that a template names."""
    return re.findall(r"\{([^{}]*)\}", template)


def _filled_grasp(template: str, cells: Mapping[str, str]) -> str:
    """Return the grasp by a template; "" if all cells that the template names are empty."""
    grasp = _filled("grasp", template, cells)
    names = template_columns(template)
    return grasp if not names or any(cells[name] for name in names) else ""


def _warn_of_empty_sessions(rows: Rows, result: Scan) -> None:
    """Warn about rows in which all cells of the session are empty, because they are one session."""
    used = template_columns(result.session_template)
    empty = [
        part.text
        for part, texts in sorted(rows.items())
        if used and not any(texts.get(name, "") for name in used)
    ]
    if empty:
        counted = f"{len(empty)} of {len(rows)} rows have no session"
        fix = f"fill the cells of {', '.join(map(repr, used))}"
        reason = f"they are one session ({listed(empty)}); {fix}"
        result.remarks["warning"].append((counted, reason))


def _alike(rows: Iterable[Mapping[str, str]], columns: Collection[str]) -> set[str]:
    """Return the texts of columns that differ only in blanks or in their Unicode form.

    Two folders can have such names, for example `day 1` with one blank and with two blanks.
    """
    texts = {row[column] for row in rows for column in columns}
    spellings: dict[str, set[str]] = defaultdict(set)
    for text in texts:
        spellings[plain_text(text)].add(text)
    return {text for forms in spellings.values() if len(forms) > 1 for text in forms}


def _plain(
    texts: Mapping[str, str], sessions: Collection[str], exact: Collection[str]
) -> dict[str, str]:
    """Return plain texts, except in columns of `sessions` the `exact` names of folders."""
    return {
        column: text if column in sessions and text in exact else plain_text(text)
        for column, text in texts.items()
    }


def _grasp_columns(rows: Rows, columns: Mapping[str, str], settings: ImportSettings) -> list[str]:
    """Return the columns that identify a grasp: those of --grasp, else those of the role.

    `object` also identifies a grasp, but recordings without an object can still be one grasp.
    """
    if settings.grasp:
        names = next(iter(rows.values()), {})
        return [name for name in template_columns(settings.grasp) if name in names]
    return [name for name, role in columns.items() if role in ("grasp", "grasp_id")]


def _note_empty_grasps(
    rows: Rows, columns: Mapping[str, str], settings: ImportSettings, result: Scan
) -> None:
    """Warn about rows whose grasp is empty, because each of them would be a grasp."""
    used = _grasp_columns(rows, columns, settings)
    # With --grasp, all columns have to be filled; without it, one of them is sufficient.
    is_complete = all if settings.grasp else any
    empty = [part for part, texts in rows.items() if not is_complete(texts[name] for name in used)]
    if not used or not empty:
        return
    counted = f"{len(empty)} of {len(rows)} rows have no grasp"
    consequence = "each of them is a grasp of its own"
    if settings.grasp:
        consequence = (
            f"a column of --grasp {settings.grasp!r} is empty; a row in which all are empty is a"
            " grasp of its own"
        )
    fix = f"fill the cells of {', '.join(map(repr, used))}, or name other columns with --grasp"
    examples = listed([part.text for part in sorted(empty)])
    result.remarks["warning"].append((counted, f"{consequence} ({examples}); {fix}"))


def _with_joined_numbers(
    rows: Rows, columns: Mapping[str, str], settings: ImportSettings, result: Scan
) -> Rows:
    """Return rows in which each number of a grasp or sample has one spelling, and note numbers that
    had several."""
    samples = [name for name, role in columns.items() if role == "sample"]
    joined = {part: dict(texts) for part, texts in rows.items()}
    for name in [*_grasp_columns(rows, columns, settings), *samples]:
        spellings = joined_spellings({texts[name] for texts in rows.values()})
        for texts in joined.values():
            texts[name] = spellings.get(texts[name], texts[name])
        if spellings:
            numbers = sorted(set(spellings.values()))
            forms = sorted(form for form, number in spellings.items() if number == numbers[0])
            if len(numbers) == 1:
                problem = f"1 number of {name} is spelled in several ways"
            else:
                problem = f"{len(numbers)} numbers of {name} are spelled in several ways"
            example = f"each is one {name}, e.g. {', '.join(map(repr, forms))}"
            result.remarks["note"].append((problem, example))
    return joined


def _note_grasps_without_object(result: Scan) -> None:
    """Warn about numbered grasps without an object or label, if other rows have one.

    Equal numbers of different objects would be one grasp.
    """
    numbered = [file for file in result.files if file.has_grasp_number]
    empty = [file.path.as_posix() for file in numbered if not file.cells["object"]]
    has_label = any(file.cells["object"] for file in numbered)
    if empty and has_label:
        counted = (
            f"{len(empty)} of {len(numbered)} rows have the number of a grasp, but no object or"
            " label"
        )
        reason = f"equal numbers are one grasp ({listed(empty)}); fill the cells"
        result.remarks["warning"].append((counted, reason))


def _use_stored_name(result: Scan, session: str, known: Mapping[str, KnownSession]) -> None:
    """Replace `--session` by the text of the session if it is the name of a known session.

    The text of another session has priority. Values of folders and tables are never names.
    """
    stored = known.get(session)
    if stored is None or stored.text is None:
        return
    if any(other.text == session for other in known.values()):
        return
    text = stored.text
    result.remarks["note"].append((f"session {session!r}", f"is the session of {text!r}"))
    result.files = [replace(file, session=text) for file in result.files]
    result.played = defaultdict(list, {text: result.played[session]} if result.played else {})


def _name_sessions(result: Scan, known: Mapping[str, KnownSession]) -> None:
    """Replace the values of sessions by their names, and note values that differ from the names."""
    paths: dict[str, set[str]] = {value: set() for value in result.played}
    for file in result.files:
        paths.setdefault(file.session, set()).add(file.path.as_posix())
    names = stored_session_names(paths, known, paths)
    result.session_texts = {name: value for value, name in names.items()}
    for value, name in sorted(names.items()):
        checked_name(name, "session")
        if is_changed(value, name):
            result.remarks["note"].append((f"session {value!r}", f"is stored as {name}"))
    result.files = [replace(file, session=names[file.session]) for file in result.files]
    played = {names[value]: sounds for value, sounds in result.played.items()}
    result.played = defaultdict(list, played)


def _sample_numbers(texts: Collection[str], result: Scan) -> dict[str, str]:
    """Return the numbers of samples: whole numbers, or places of texts in alphabetical order, which
    are noted."""
    numbers = {text: whole_number(text or "0") for text in texts}
    if all(numbers.values()):
        return numbers
    places = {text: str(place) for place, text in enumerate(sorted(texts))}
    examples = listed([f"{text!r} is {place}" for text, place in places.items()])
    reason = f"numbers of repeats: {examples}; to keep the texts, rename the column or group"
    result.remarks["note"].append(("the texts of `sample` are stored as", reason))
    return places
