"""Import two tables of features without recordings, with five rows per grasp, and look at a row.

The command for the same is
`ajgdata import --features day1.csv --dataset finger --grasp '{point_index}'`.
"""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import ajgdata
from ajgdata.paths import Paths
from ajgdata.pipeline.table_import import import_table
from ajgdata.store.sessions import read_recordings
from ajgdata.types import ImportSettings

project = Path(tempfile.mkdtemp())
columns = [f"feature_{number}" for number in range(53)]
points = np.arange(60) // 5  # five rows per point, which is one grasp
labels = np.array(["contact", "no_contact", "edge"])[points % 3]
for day in (1, 2):
    values = np.random.default_rng(day).normal(size=(60, 53))
    values[:, 0] += 5 * (labels == "contact")
    table = pd.DataFrame(values, columns=columns)
    table["simplified_label"] = labels
    table["original_label"] = [f"{label}_left" for label in labels]
    table["point_index"] = points
    table.to_csv(project / f"day{day}.csv", index=False)

(project / "datasets").mkdir()
paths = Paths(project)
for day in (1, 2):
    options = ImportSettings(grasp="{point_index}")
    _, result = import_table(paths, "finger", project / f"day{day}.csv", settings=options)
    print(f"day{day}: {result.added} rows added")

dataset = ajgdata.load_dataset("finger", project)
rows, _ = read_recordings(paths.session("finger", "day2"))
print(dataset.tasks, f"from {len(dataset.spec.features.columns)} columns")
print(rows[7].file, rows[7].table_row, rows[7].grasp_id, rows[7].labels["simplified_label"])
