"""Plot mean spectra of two objects from the sample that is part of the package."""

from matplotlib.figure import Figure

import ajgdata

with ajgdata.tutorial.load_features("ycb") as features:  # an xarray.Dataset
    audible = features.feature.sel(frequency=slice(500, 6000))  # Hz
    mean = audible.groupby("object").mean().sel(object=["screw", "banana"]).load()

figure = Figure(figsize=(7, 4), layout="constrained")
mean.plot.line(x="frequency", ax=figure.subplots())
figure.suptitle(f"{features.attrs['data_set']} ({features.attrs['source']})")
figure.savefig("first_plot.png")
