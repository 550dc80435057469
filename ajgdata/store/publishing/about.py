"""Words on a data set that it is published with: who, why, under which licence, and examples."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ajgdata.paths import Tree
from ajgdata.store.publishing.table import Table

#: SPDX identifiers that are known here; others are quoted as they stand.
LICENCES = (
    *("CC0-1.0", "CC-BY-3.0", "CC-BY-4.0", "CC-BY-SA-3.0", "CC-BY-SA-4.0", "CC-BY-NC-3.0"),
    *("CC-BY-NC-4.0", "CC-BY-NC-SA-4.0", "CC-BY-ND-4.0", "ODbL-1.0", "ODC-By-1.0", "PDDL-1.0"),
    *("MIT", "BSD-2-Clause", "BSD-3-Clause", "Apache-2.0"),
)
#: Text of the licence that we hold; it is packaged.
CC0_FILE = Path(__file__).with_name("CC0-1.0.txt")
NO_LICENCE = ("", "not stated", "none stated")


@dataclass(frozen=True)
class About:
    """The answers to who, what and whence, in words."""

    name: str
    title: str
    description: str
    licence: str
    authors: tuple[str, ...]
    citation: str
    url: str
    version: str
    date: str
    source: Literal["simulated", "recorded"]
    task_kinds: frozenset[str] = frozenset()
    has_gripper: bool = True

    @property
    def spdx(self) -> str:
        """The licence's SPDX identifier; empty if it has none."""
        known = {licence.lower(): licence for licence in LICENCES}
        return known.get(self.licence.lower().replace(" ", "-"), "")

    @property
    def licence_url(self) -> str:
        """Return the address of the licence; empty if nobody knows."""
        return f"https://spdx.org/licenses/{self.spdx}.html" if self.spdx else ""

    @property
    def is_unlicensed(self) -> bool:
        """Return True if nobody said what others may do with it."""
        return self.licence.strip().lower() in NO_LICENCE

    @property
    def keywords(self) -> list[str]:
        """Words that people look for."""
        gripper = ["jamming gripper", "soft robotics", "tactile"] if self.has_gripper else []
        return ["acoustic sensing", *gripper, self.source]

    @property
    def reference(self) -> str:
        """Return the citation on one line."""
        year = f" ({self.date[:4]})" if self.date else ""
        own = f"{', '.join(self.authors)}{year}. {self.title}, version {self.version}. Data set."
        return self.citation or own


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
