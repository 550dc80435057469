"""Train your own model on one fold of the evaluation, and compute its error."""

import torch
from torch.utils.data import DataLoader, TensorDataset

import ajgdata

train, test = ajgdata.load_dataset("size").folds("size")[0]  # no grasp is in both
middle, spread = train.y.mean(), train.y.std()

torch.manual_seed(0)
bins = train.X.shape[1]
network = torch.nn.Sequential(
    torch.nn.BatchNorm1d(bins), torch.nn.Linear(bins, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1)
)
optimiser = torch.optim.AdamW(network.parameters(), lr=1e-3)


def pairs(part):
    """Return spectra and labels as pairs of tensors."""
    return TensorDataset(torch.from_numpy(part.X), torch.tensor(part.y, dtype=torch.float32))


loader = DataLoader(pairs(train), batch_size=64, shuffle=True)
for _ in range(200):
    for features, edge_mm in loader:
        optimiser.zero_grad()
        error = network(features)[:, 0] - (edge_mm - middle) / spread
        error.square().mean().backward()
        optimiser.step()

network.eval()
with torch.no_grad():
    features, edge_mm = pairs(test)[:]
    predicted = network(features)[:, 0] * spread + middle
rmse_mm = (predicted - edge_mm).square().mean().sqrt().item()
chance_mm = (edge_mm - middle).square().mean().sqrt().item()
print(f"RMSE {rmse_mm:.1f} mm; always the mean: {chance_mm:.1f} mm")
