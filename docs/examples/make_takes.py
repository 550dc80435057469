"""Write recordings of the virtual gripper, takes/<n>_<label>.wav, as an example for the import.

    python docs/examples/make_takes.py takes

For readers without a gripper. Real recordings replace this folder; all other steps stay the same.
The comment in each file begins with *simulated*, so that the import calls the data set simulated.
"""

import sys
from pathlib import Path

import soundfile

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, excitation_sweep, record, simulate

OBJECTS = {
    "cube": {"kind": "cube", "edge_mm": 25},
    "ball": {"kind": "sphere", "diameter_mm": 30},
    "bar": {"kind": "box", "length_mm": 60, "width_mm": 15, "height_mm": 25},
}
GRASPS = 6
QUICK = {"dx_mm": 6, "max_time_s": 0.006}  # a coarse grid: for trying things out, not for results

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "takes")
folder.mkdir(parents=True, exist_ok=True)
sweep = excitation_sweep()
soundfile.write(folder / "0_sweep.wav", sweep, SAMPLE_RATE_HZ, subtype="PCM_24")
number = 0
for label, shape in OBJECTS.items():
    for grasp in range(GRASPS):
        number += 1
        placed = {"angle_deg": 10 * grasp - 25, "offset_x_mm": grasp - 2.5}
        scene = Scene.model_validate({"object": shape, "grasp": placed, "numerics": QUICK})
        samples = record(simulate(scene), sweep, seed=number).samples
        path = folder / f"{number}_{label}.wav"
        with soundfile.SoundFile(path, "w", SAMPLE_RATE_HZ, 1, "PCM_24") as file:
            file.comment = "simulated by the virtual gripper of ajgdata"
            file.write(samples)
print(f"{number} recordings of {len(OBJECTS)} objects in {folder}")
