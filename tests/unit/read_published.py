"""Read the published data set in the working folder with four libraries; compare with metadata.csv.

A script, because `datasets` and `mlcroissant` read their caches from the environment at import.
"""

import hashlib
import math
from pathlib import Path

import frictionless
import mlcroissant
import pandas as pd
import soundfile
import xarray

import datasets

LABELS = pd.read_csv("metadata.csv", dtype=str, keep_default_na=False).to_dict("records")


def same(text: str, value: object) -> bool:
    """Return whether a reader's value is the text of the cell; readers convert numbers and
    booleans, and have one value for empty cells."""
    value = value.decode() if isinstance(value, bytes) else value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return text == ""
    if str(value) == text or str(value).lower() == text.lower():
        return True
    return float(text) == float(str(value))


def compare(reader: str, rows: list[dict]) -> None:
    """Stop unless all rows of a reader have the cells of metadata.csv that it names."""
    assert len(rows) == len(LABELS), reader
    for label, row in zip(LABELS, rows, strict=True):
        for column, text in label.items():
            if not (reader == "xarray" and column == "file_name"):
                assert same(text, row[column]), (reader, column, text, row[column])


with xarray.open_dataset("features.nc") as store:
    columns = {
        str(n): store[n].values.tolist() for n in store.coords if store[n].dims == ("recording",)
    }
    assert store.feature.dims == ("recording", "frequency")
    assert bool(store.feature.notnull().all())
compare(
    "xarray", [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
)

loaded = datasets.load_dataset(str(Path.cwd()), split="train", streaming=True)
audio = list(loaded.cast_column("audio", datasets.Value("string")))
for row in audio:
    row["file_name"] = Path(row["audio"]).resolve().relative_to(Path.cwd()).as_posix()
    assert len(soundfile.read(row["audio"])[0])
compare("datasets", audio)

croissant = mlcroissant.Dataset("croissant.json")
records = croissant.records("recordings")
compare("mlcroissant", [{k.removeprefix("recordings/"): v for k, v in r.items()} for r in records])
hashes = {
    record["audio/file_name"].decode(): hashlib.sha256(record["audio/content"]).hexdigest()
    for record in croissant.records("audio")
}
assert hashes == {label["file_name"]: label["sha256"] for label in LABELS}

report = frictionless.validate("datapackage.json")
assert report.valid, report.flatten(["type", "message"])
resource = frictionless.Package("datapackage.json").get_resource("metadata")
compare("frictionless", [row.to_dict() for row in resource.read_rows()])
print("4 readers agree with metadata.csv")
