"""Read the table of `ajgdata export size --parquet size.parquet` without ajgdata."""

import json

import numpy as np
import pandas as pd
import pyarrow.parquet

table = pd.read_parquet("size.parquet")  # one row per recording
spectra = np.stack(table["feature"])  # (recordings, bins), float32

schema = pyarrow.parquet.read_schema("size.parquet")
unit = schema.field("edge_mm").metadata[b"units"].decode()
frequency_hz = np.array(json.loads(schema.field("feature").metadata[b"frequency_hz"]))

loudest_hz = {}
for edge, rows in table.groupby("edge_mm").indices.items():  # rows without a label are left out
    loudest_hz[edge] = frequency_hz[spectra[rows].mean(axis=0).argmax()]
    print(f"{edge:g} {unit}: {len(rows)} recordings, loudest at {loudest_hz[edge]:.0f} Hz")
