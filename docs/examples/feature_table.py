"""Import a table of features without recordings, as CSV and as Parquet, and look at its rows.

The command for the same is `ajgdata import --features day1.csv --dataset finger`.
"""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import ajgdata
from ajgdata.paths import Paths
from ajgdata.pipeline.table_import import import_table
from ajgdata.store.sessions import read_recordings

project = Path(tempfile.mkdtemp())
columns = [f"feature_{number}" for number in range(53)]
labels = ["contact", "no_contact", "edge"] * 20
for day in (1, 2):
    values = np.random.default_rng(day).normal(size=(60, 53))
    values[:, 0] += [5 * (label == "contact") for label in labels]
    table = pd.DataFrame(values, columns=columns)
    table["simplified_label"] = labels
    table["original_label"] = [f"{label}_left" for label in labels]
    table["point_index"] = np.arange(60) // 5  # five rows per point
    table.to_csv(project / f"day{day}.csv", index=False)

(project / "datasets").mkdir()
paths = Paths(project)
for day in (1, 2):
    _, result = import_table(paths, "finger", project / f"day{day}.csv")
    print(f"day{day}: {result.added} rows added")

dataset = ajgdata.load_dataset("finger", project)
rows, _ = read_recordings(paths.session("finger", "day2"))
print(dataset.tasks, f"from {len(dataset.spec.features.columns)} columns")
print(rows[7].file, rows[7].table_row, rows[7].labels["simplified_label"])
