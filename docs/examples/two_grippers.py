"""Compare two grippers: how far apart are their spectra, and does a model survive the change?"""

import numpy as np

import ajgdata
from ajgdata.models import make_model

train, test = ajgdata.load_dataset("size").folds("size")[0]
with ajgdata.load_features("size_other_membrane") as other:
    other.load()

model = make_model("linear_plain", "regression", seed=0).fit(train.X, train.y)


def rmse_mm(X, y):
    """Root mean square error of the model."""
    return float(np.sqrt(np.mean((model.predict(X) - y) ** 2)))


own_mm = rmse_mm(test.X, test.y)
other_mm = rmse_mm(other.feature.values, other.edge_mm.values)
change = other.feature.values.mean(axis=0) - train.X.mean(axis=0)
apart = float(np.linalg.norm(change) / np.linalg.norm(train.X.mean(axis=0)))
print(f"RMSE {own_mm:.2f} mm on its own gripper, {other_mm:.2f} mm on the other")
print(f"mean spectra differ by {apart:.0%}")
