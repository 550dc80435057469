"""The examples of a dataset card: a few lines for each reader. A test runs them."""

from __future__ import annotations

from ajgdata.paths import Tree
from ajgdata.store.publishing.table import Table


def examples(table: Table) -> dict[str, str]:
    """Return the title and code of each example, to be run in the folder of the data set."""
    label = next((column.name for column in table.columns if column.is_target), "object")
    return {
        "Spectra, with xarray": (
            "import xarray\n"
            f'features = xarray.open_dataset("{Tree.FEATURES}")\n'
            f'print(features.feature.groupby("{label}").mean())\n'
        ),
        "Spectra, with h5py": (
            "import h5py\n"
            f'store = h5py.File("{Tree.FEATURES}")\n'
            'print(store["feature"].shape, "spectra up to", store["frequency"][-1], "Hz")\n'
        ),
        "Recordings, with pandas and soundfile": (
            "import pandas, soundfile\n"
            f'labels = pandas.read_csv("{Tree.METADATA}")\n'
            "samples, rate_hz = soundfile.read(labels.file_name[0])\n"
        ),
        "Recordings, with Hugging Face datasets": (
            "import datasets\n"
            f'files = {{"data_files": ["{Tree.METADATA}", "audio/**"], "split": "train"}}\n'
            'recordings = datasets.load_dataset("audiofolder", **files, streaming=True)\n'
            'print(next(iter(recordings.cast_column("audio", datasets.Value("string")))))\n'
        ),
        "Labels, with Croissant": (
            "import mlcroissant\n"
            f'labels = mlcroissant.Dataset("{Tree.CROISSANT}").records("recordings")\n'
            "print(next(iter(labels)))\n"
        ),
        "Labels, with Frictionless": (
            "import frictionless\n"
            f'labels = frictionless.Package("{Tree.DATAPACKAGE}").get_resource("metadata")\n'
            "print(labels.read_rows()[0])\n"
        ),
    }
