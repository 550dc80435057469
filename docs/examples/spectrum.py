"""Load the features of a data set and plot the mean spectrum of each size."""

from matplotlib.figure import Figure

import ajgdata

with ajgdata.load_features("size") as features:
    audible = features.feature.sel(frequency=slice(200, 8000))  # in Hz
    mean = audible.groupby("edge_mm").mean().load()  # (edge_mm, frequency)

figure = Figure(figsize=(7, 4), layout="constrained")
axes = figure.subplots()
for edge in mean.edge_mm.values:
    axes.semilogy(mean.frequency, mean.sel(edge_mm=edge), label=f"{edge:g} mm")
axes.set(xlabel="frequency in Hz", ylabel="share of the spectrum", title=features.attrs["source"])
axes.legend()
figure.savefig("spectrum.png")

loudest_hz = mean.mean("edge_mm").idxmax("frequency").item()
print(f"{len(mean.edge_mm)} sizes; loudest at {loudest_hz:.0f} Hz")
