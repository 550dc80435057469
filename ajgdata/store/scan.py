"""Folder of recordings -> rows: which file is which recording, by pattern or by table.

This is the only place where labels are read out of file names.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import pandas as pd

from ajgdata.paths import SESSION_FILE
from ajgdata.store.files import plain_text, read_text, sha256_of, why_no_file
from ajgdata.types import HIGHEST_SAMPLE, LONGEST_NAME, DataError, ImportSettings, is_reserved

#: Endings of audio files. libsndfile does not read those of the second line: their recordings are
#: imported and reported as unusable.
AUDIO_SUFFIXES = {
    *(".wav", ".wave", ".flac", ".ogg", ".oga", ".opus", ".mp3", ".aif", ".aiff", ".au", ".caf"),
    *(".m4a", ".aac", ".wma"),
}
STARTER_KIT = r"(?:.*/)?(?P<n>\d+)_(?P<label>[^/]+)\.[^./]+"
#: Column or group in lower case -> its role; every other column or group is a label.
ROLES = {
    **{name: name for name in ("recording_id", "grasp", "grasp_id", "object", "sample")},
    **{"quality": "quality", "session": "session", "session_id": "session"},
}
_DELIMITERS = ",;\t"
_DECIMAL_COMMA = r"^([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)$"
Named = list[tuple[str, str]]
#: Why a recording whose name begins with a dot is skipped.
HIDDEN = "hidden: rename it if it is a recording"


@dataclass(frozen=True)
class ScannedFile:
    """One recording in the folder: path relative to it, its roles and labels.

    `quality` and `recording_id` are "" if the folder does not specify them.
    """

    path: Path
    session: str
    grasp: str
    object: str
    sample: int
    labels: Mapping[str, str]
    quality: str = ""
    recording_id: str = ""

    def cell(self, column: str) -> str:
        """Return what stands in a column that can be learnt."""
        return self.object if column == "object" else self.labels.get(column, "")


@dataclass
class Scan:
    """Recordings found in a folder, played sounds by session, and notes.

    By name and reason: `missing` are files that belong to the recordings but cannot be imported,
    `skipped` all other files.
    """

    files: list[ScannedFile] = field(default_factory=list)
    excitations: dict[str, Path] = field(default_factory=dict)
    missing: Named = field(default_factory=list)
    skipped: Named = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def scan(folder: Path, settings: ImportSettings, name: str) -> Scan:
    """Return every recording below `folder` (sorted by path), by `settings.pattern` or `.table`.

    `name` is the session of recordings without a session. Raises DataError if the folder, the
    pattern or the table cannot be used, or if nothing in the folder matches.
    """
    if not folder.is_dir():
        raise DataError(folder, "is not a folder", "name the folder that holds the recordings")
    audio, closed, skipped = search(folder)
    if not audio:
        raise DataError(folder, "holds no audio files", "name a folder with .wav, .flac or .ogg")
    result = Scan(missing=closed, skipped=skipped)
    if settings.table:
        cells = _by_table(folder, audio, settings, result)
    else:
        cells = _by_name(audio, settings, name, result)
    for path in list(cells.index):
        if wrong := why_no_file(folder / path):
            result.missing.append((path.as_posix(), "; ".join(wrong)))
            cells = cells.drop(path)
    if cells.empty:
        left_out = [*result.missing, *result.skipped]
        example = ": {!r} {}".format(*left_out[0]) if left_out else ""
        fix = "correct --pattern or --file (the whole path inside the folder)"
        raise DataError(folder, f"none of its audio files can be imported{example}", fix)
    result.files = list(_recordings(cells.map(plain_text), settings, name, result))
    return result


def search(folder: Path) -> tuple[list[Path], Named, Named]:
    """Return the audio files below a folder, sorted and relative to it, folders that may contain
    recordings but cannot be searched, and other files and folders that are skipped.

    Hidden folders are ignored. Sessions of data sets, virtual environments and links to
    folders are not searched. A folder that does not exist holds nothing.
    """
    audio: list[Path] = []
    closed: Named = []
    skipped: Named = []

    def refused(error: OSError) -> None:
        if not isinstance(error, FileNotFoundError):
            where = os.path.relpath(error.filename, folder)
            closed.append((where, f"cannot be searched ({error.strerror})"))

    for root, folders, names in os.walk(folder, onerror=refused):
        here = Path(root).relative_to(folder)
        folders[:] = [one for one in folders if not one.startswith(".")]
        for one in list(folders):
            if Path(root, one).is_symlink():  # os.walk does not follow it
                reason = "a link to a folder, not searched: name that folder"
                closed.append(((here / one).as_posix(), reason))
            elif reason := _why_not_searched(Path(root, one)):
                skipped.append(((here / one).as_posix(), reason))
                folders.remove(one)
        for file in (here / one for one in names):
            if file.suffix.lower() in AUDIO_SUFFIXES:
                if reason := _why_not_imported(file.as_posix()):
                    shown = file.as_posix() if reason == HIDDEN else ascii(file.as_posix())
                    skipped.append((shown, reason))
                else:
                    audio.append(file)
    copies = _copies_of_wavs(audio)
    skipped += [
        (file.as_posix(), "probably the same sound as the WAV of its name") for file in copies
    ]
    return sorted(set(audio) - copies), sorted(closed), sorted(skipped)


def _why_not_imported(name: str) -> str:
    """Return why an audio file with this relative path is skipped; empty if it is not."""
    if PurePosixPath(name).name.startswith("."):
        return HIDDEN
    is_plain = name.isprintable() and name.strip() == name
    return "" if is_plain else "its name is not plain text: rename it"


def _copies_of_wavs(audio: list[Path]) -> set[Path]:
    """Return files whose name differs from that of a WAV by its suffix only."""
    wavs = {path for path in audio if path.suffix.lower() == ".wav"}
    names = {path.with_suffix("") for path in wavs}
    return {path for path in audio if path not in wavs and path.with_suffix("") in names}


def _why_not_searched(folder: Path) -> str:
    """Return why a folder cannot contain new recordings; empty if it can."""
    if (folder / SESSION_FILE).is_file():
        return "a session of a data set, not searched"
    return "a virtual environment, not searched" if (folder / "pyvenv.cfg").is_file() else ""


def _by_name(audio: list[Path], settings: ImportSettings, name: str, result: Scan) -> pd.DataFrame:
    """Return the named groups of each file that matches, by path."""
    starter_kit = settings.pattern in ("", "starter-kit")
    try:
        pattern = re.compile(STARTER_KIT if starter_kit else settings.pattern)
    except re.error as error:
        raise DataError("--pattern", f"not a regular expression ({error})", "correct it") from None
    if not pattern.groupindex:
        raise DataError("--pattern", "has no named group", r"name the label: (?P<label>[^/]+)")
    rows = {}
    for path in audio:
        match = pattern.fullmatch(path.as_posix())
        if not match:
            result.skipped.append((path.as_posix(), "does not match the pattern"))
        elif starter_kit and int(match["n"]) == 0:
            result.excitations.setdefault(_folder_session(path, name), path)
        else:
            rows[path] = match.groupdict(default="")
    return pd.DataFrame.from_dict(rows, orient="index", columns=list(pattern.groupindex))


def _folder_session(path: Path, name: str) -> str:
    """Return the session of a file without a session: its folder, if the scanned one has any."""
    return session_name(path.parent.as_posix()) if path.parent.name else name


def _by_table(
    folder: Path, audio: list[Path], settings: ImportSettings, result: Scan
) -> pd.DataFrame:
    """Return the cells of each row of the table whose file is in the folder, by path."""
    where = folder / settings.table
    table = _joined(folder, read_label_table(where), settings.join)
    table.index = pd.Index([Path(one) for one in _filled("file", settings.file, table)])
    if twice := table.index[table.index.duplicated()].tolist():
        raise DataError(where, f"{twice[0]} stands in two rows", "keep one of them")
    missing = sorted(set(table.index) - set(audio))
    reason = f"in {settings.table} but not in the folder"
    result.missing += [(str(path), reason) for path in missing]
    result.skipped += [
        (str(path), f"no row in {settings.table}") for path in sorted(set(audio) - set(table.index))
    ]
    return table.drop(missing).sort_index()


def read_label_table(path: Path) -> pd.DataFrame:
    """Return a table with commas, semicolons or tabs; every cell is stripped text.

    Empty rows and columns are dropped. Between semicolons and tabs, numbers such as `1,5` get a
    decimal point, unless all commas of the column may separate thousands (`1,000`). Raises
    DataError for a table without rows, for a column without a name or with the name of another,
    and for a row with more cells than the header.
    """
    text = read_text(path)
    mark = max(_DELIMITERS, key=text.partition("\n")[0].count)
    options = {"header": None, "dtype": str, "keep_default_na": False, "skipinitialspace": True}
    try:
        cells = pd.read_csv(io.StringIO(text), sep=mark, **options)  # type: ignore[call-overload]
    except (pd.errors.EmptyDataError, pd.errors.ParserError) as error:
        reason = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        fix = "correct the quotes and the number of cells"
        raise DataError(path, f"is not a table ({reason})", fix) from None
    cells = cells.fillna("").map(str.strip)
    if mark != ",":
        cells = cells.apply(_decimal_points)
    cells = cells.loc[(cells != "").any(axis=1), (cells != "").any(axis=0)]
    header = cells.iloc[0].tolist() if len(cells) else []
    if len(cells) < 2 or "" in header or len(set(header)) < len(header):
        problem = f"needs rows and a different name for each column; its header is {header}"
        raise DataError(path, problem, "write a line with column names and a line per file")
    return cells.iloc[1:].set_axis(header, axis=1)


def _decimal_points(column: pd.Series) -> pd.Series:
    """Return a column with decimal points, unless all its commas may separate thousands."""
    with_comma = column[column.str.fullmatch(r"[+-]?\d[\d,]*,\d.*")]
    if with_comma.str.fullmatch(r"[+-]?\d{1,3}(,\d{3})+").all():
        return column
    return column.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)


def _joined(folder: Path, table: pd.DataFrame, tables: Mapping[str, str]) -> pd.DataFrame:
    """Return a table with the columns of further `tables` (file in `folder`: key column) added.

    Columns that the first table has are not replaced; a key without a row gives empty cells.
    """
    for file, key in tables.items():
        other = read_label_table(folder / file)
        added = [key, *(column for column in other.columns if column not in table.columns)]
        try:
            table = table.merge(other[added], on=key, how="left", validate="many_to_one")
        except (KeyError, pd.errors.MergeError) as error:
            fix = f"both tables need the column {key!r}, and {file} each key once"
            raise DataError(folder / file, f"cannot be joined ({error})", fix) from None
        table = table.fillna("")
    return table


def slug(text: str) -> str:
    """Return `text` with everything but letters, digits and - replaced by _."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_-") or "x"


def session_name(text: str) -> str:
    """Return `text` as the name of a session; a name that is too long ends in a digest."""
    name = slug(text)
    if len(name) <= LONGEST_NAME:
        return name
    return f"{name[: LONGEST_NAME - 13]}-{sha256_of(name.encode())[:12]}"


def target_column(text: str) -> str:
    """Return the column of a target called `text`: `object` is one that every recording has."""
    return "object" if text.lower() == "object" else slug(text)


def _filled(option: str, template: str, cells: pd.DataFrame) -> list[str]:
    """Return a template such as '{Grasp no.}' with the cells of each row put in."""
    names = re.findall(r"\{([^{}]*)\}", template)
    if unknown := [name for name in names if name not in cells]:
        problem = f"{template!r} names {unknown[0]!r}"
        raise DataError(f"--{option}", problem, f"there are {list(cells.columns)}")
    parts = re.split(r"\{([^{}]*)\}", template)  # text, name, text, name, …, text
    columns = [
        cells[one].tolist() if odd % 2 else [one] * len(cells) for odd, one in enumerate(parts)
    ]
    return ["".join(texts) for texts in zip(*columns, strict=True)]


def _recordings(
    cells: pd.DataFrame, settings: ImportSettings, name: str, result: Scan
) -> Iterator[ScannedFile]:
    """Yield the recording of each row of `cells`.

    A number of a grasp counts within its object, `grasp_id` within its session.
    """
    named, labels = _with_roles(cells, settings, result)

    def role(name: str, template: str = "") -> list[str]:
        if template:
            return _filled(name, template, cells)
        return named[name].tolist() if name in named else [""] * len(named)

    objects, sessions = role("object", settings.object), role("session", settings.session)
    grasp_ids = role("grasp", settings.grasp) if settings.grasp else role("grasp_id")
    grasps, samples = role("grasp"), _samples(role("sample"))
    qualities, ids = role("quality"), role("recording_id")
    label = next((one for one in labels if one.lower() == "label"), "")
    is_convention = settings.pattern in ("", "starter-kit") and not settings.table
    for row, (path, texts) in enumerate(zip(cells.index, named.to_dict("records"), strict=True)):
        object_name = objects[row] or texts.get(label, "")
        grasp = f"{object_name}/{grasps[row]}" if object_name and grasps[row] else grasps[row]
        default = _folder_session(path, name) if is_convention else name
        yield ScannedFile(
            path=path,
            session=session_name(sessions[row] or default),
            grasp=grasp_ids[row] or grasp or path.with_suffix("").as_posix(),
            object=object_name,
            sample=samples[row],
            labels={one: texts[one] for one in labels},
            quality=qualities[row],
            recording_id=ids[row],
        )


def _with_roles(
    cells: pd.DataFrame, settings: ImportSettings, result: Scan
) -> tuple[pd.DataFrame, list[str]]:
    """Return the cells with roles and labels as names of the columns, and the labels.

    Raises DataError for two columns with one meaning.
    """
    meanings = {str(one): ROLES.get(slug(str(one)).lower(), slug(str(one))) for one in cells}
    named = cells.rename(columns=meanings)
    if twice := named.columns[named.columns.duplicated()].tolist():
        columns = [column for column, meaning in meanings.items() if meaning == twice[0]]
        problem = f"columns {columns} would all be {twice[0]!r}"
        raise DataError(settings.table or "--pattern", problem, "rename all but one")
    others = [one for one in meanings.values() if one not in ROLES.values()]
    labels = [one for one in others if not is_reserved(one) and len(one) <= LONGEST_NAME]
    if unused := [one for one in others if one not in labels]:
        result.notes.append(f"not stored, because no label can have these names: {unused}")
    return named, labels


def _samples(texts: list[str]) -> list[int]:
    """Return repeats as numbers: whole numbers as they are, else texts in alphabetical order."""
    numbers = pd.to_numeric(pd.Series(texts).replace("", "0"), errors="coerce")
    if ((numbers % 1 == 0) & numbers.between(0, HIGHEST_SAMPLE)).all():
        return numbers.astype(int).tolist()
    places = {text: place for place, text in enumerate(sorted(set(texts)))}
    return [places[text] for text in texts]
