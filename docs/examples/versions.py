"""Compare two versions of a data set: one label is corrected, and one recording is new.

The command for the same is `ajgdata diff before:mine after:mine`.
"""

import tempfile
from pathlib import Path

import numpy as np
import soundfile

from ajgdata.paths import Paths
from ajgdata.pipeline.dataset_differences import compare_versions
from ajgdata.pipeline.dataset_versions import read_version
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.labelling import change_recording, recording_state

RATE_HZ = 44_100


def import_takes(project, names):
    """Write one tone per file name into a folder, and import the folder as data set `mine`."""
    for folder in ("datasets", "takes"):
        (project / folder).mkdir(parents=True)
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    for number, name in enumerate(names):
        tone = 0.5 * np.sin(2 * np.pi * (500 + 100 * number) * time_s)
        soundfile.write(project / "takes" / name, tone, RATE_HZ)
    paths = Paths(project)
    import_folder(paths, "mine", project / "takes", settings=None)
    return paths


folder = Path(tempfile.mkdtemp())
import_takes(folder / "before", ["1_ball.wav", "2_cube.wav", "3_cube.wav"])
after = import_takes(folder / "after", ["1_ball.wav", "2_cube.wav", "3_cube.wav", "4_bar.wav"])
seen = recording_state(after, "mine", "takes/3_cube")
change_recording(
    after, "mine", seen.recording, "label", column="label", value="bar", version=seen.version
)

result = compare_versions(
    read_version(f"{folder / 'before'}:mine"), read_version(f"{folder / 'after'}:mine")
)
print(f"{result.n_old} recordings before, {result.n_new} after")
for difference in result.differences:
    print(",".join(difference))
