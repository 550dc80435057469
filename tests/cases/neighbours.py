"""Folders of other laboratories, with short sounds that contain planted effects.

Names of folders, files and columns are those of the pinned commits in `datasets/*/source.yaml`. A
sound is a sum of tones in weak noise. An effect is the choice of these tones, so the score of each
split is known before a model is trained.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

import numpy as np
from sounds import write_wav

RATE_HZ = 48_000
#: Length of a sound, which is enough for several windows of 512 samples.
LENGTH_S = 0.06
#: Names of the tones by frequency. They are in different mel bands and spectral lines.
TONES_HZ = (1200.0, 2000.0, 3200.0, 5000.0)
ROOM_HZ = 9000.0
CLASSES = ("contact", "no_contact", "edge")
#: Workspaces 1 and 2 are most similar to each other, and workspaces 3 and 4 to workspace 1.
ROOM_LEVELS = {1: 0.14, 2: 0.20, 3: 0.06, 4: 0.11}
#: The tone of each class by workspace, if it is an effect of the session. In comparison with the
#: most similar workspace, two of three classes have each other's tones.
SESSION_TONES = {1: (0, 1, 2), 2: (1, 0, 2), 3: (0, 2, 1), 4: (0, 0, 2)}
#: Points of each class on each board.
BOARDS = {
    "squares_cutout": {"contact": 2, "no_contact": 2, "edge": 2},
    "pure_contact": {"contact": 4, "edge": 2},
    "pure_no_contact": {"no_contact": 2},
}
SWEEP_COLUMNS = (
    *("point_index", "timestamp", "x_target", "y_target", "z_target", "x", "y", "z"),
    *("normalized_x", "normalized_y", "original_label", "relabeled_label", "acoustic_filename"),
)


def tones(amplitudes: dict[float, float], seed: object, length_s: float = LENGTH_S) -> np.ndarray:
    """Return a sum of tones (n,) with random phases; `amplitudes` by frequency in Hz."""
    random = np.random.default_rng(seed)
    time_s = np.arange(round(length_s * RATE_HZ)) / RATE_HZ
    sound = 1e-3 * random.standard_normal(len(time_s))
    for frequency_hz, amplitude in amplitudes.items():
        phase = random.uniform(0, 2 * np.pi)
        sound += amplitude * np.sin(2 * np.pi * frequency_hz * time_s + phase)
    return sound


def write_sweeps(folder: Path, workspace: int, board: str, effect: str, points: dict) -> None:
    """Write a run folder with sweep.csv and five recordings per point.

    `effect` is that of the class: `object` is equal in all workspaces, `session` is another one in
    each workspace, and a `mixture` has the first at points with odd numbers, the second at others.
    Numbers of files begin again for each label.
    """
    numbers: Counter[str] = Counter()
    rows = []
    point = 0
    for label, count in points.items():
        for _ in range(count):
            point += 1
            is_session = effect == "session" or (effect == "mixture" and point % 2 == 0)
            choice = SESSION_TONES[workspace] if is_session else (0, 1, 2)
            tone_hz = TONES_HZ[choice[CLASSES.index(label)]]
            if effect == "mixture" and not is_session:
                tone_hz *= 6  # other tones than those of the session
            for _ in range(5):
                numbers[label] += 1
                name = f"{numbers[label]}_{label}.wav"
                seed = [workspace, len(board), CLASSES.index(label), numbers[label]]
                sound = tones({tone_hz: 0.3, ROOM_HZ: ROOM_LEVELS[workspace]}, seed)
                write_wav(folder / "data" / name, sound, RATE_HZ)
                rows.append(_sweep_row(point, label, name))
    with (folder / "sweep.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, SWEEP_COLUMNS)
        writer.writeheader()
        writer.writerows(rows)


def _sweep_row(point: int, label: str, name: str) -> dict[str, object]:
    row = dict.fromkeys(SWEEP_COLUMNS, 0.19)
    place = {"normalized_x": 0.1 * point, "normalized_y": 0.5}
    labels = {"original_label": "contact", "relabeled_label": label}
    names = {"point_index": point, "acoustic_filename": f"./data/{name}"}
    return row | place | labels | names | {"timestamp": 1769522137.98 + 8 * point}


#: Factor of each tone by finger. It is larger than the effect of a class, so a model that is used
#: unchanged predicts one class for all recordings of a finger.
FINGER_GAINS = {
    "029": (4, 1, 1, 1),
    "030": (1, 4, 1, 1),
    "032": (1, 1, 4, 1),
    "035": (4, 1, 1, 1),
    "037": (1, 4, 1, 1),
}
PLACES = ("none", "base", "middle", "tip")


def write_finger(
    folder: Path, finger: str, labels: tuple[str, ...], repeats: int, *, is_gained: bool
) -> None:
    """Write the session of a soft finger: `0_sweep.wav`, `1_tip.wav`, ... and a pickled model.

    A place doubles the level of its tone. A position in cm raises the level of the first tone in
    proportion. If the finger `is_gained`, its tones have the factors of the finger.
    """
    gains = FINGER_GAINS[finger] if is_gained else (1, 1, 1, 1)
    write_wav(folder / "0_sweep.wav", tones({500.0: 0.5}, 0), RATE_HZ)
    (folder / "sensor_model.pkl").write_bytes(b"never read")
    number = 0
    for _ in range(repeats):
        for label in labels:
            number += 1
            levels = [0.06] * len(TONES_HZ)
            if label in PLACES:
                levels[PLACES.index(label)] *= 2
            else:
                levels[0] *= 1 + float(label) / 9
            amplitudes = {
                frequency_hz: gain * level
                for frequency_hz, gain, level in zip(TONES_HZ, gains, levels, strict=True)
            }
            sound = tones(amplitudes, [int(finger), number])
            write_wav(folder / f"{number}_{label}.wav", sound, RATE_HZ)


#: Level in dB of the second tone of each object, and its material. Ceramic objects are nearest to
#: each other, and each wooden object is nearest to a ceramic one.
OBJECTS = {
    "cup": ("ceramic", 5.0),
    "bowl": ("ceramic", 0.0),
    "spoon": ("wood", -7.5),
    "board": ("wood", 12.5),
}


def write_taps(folder: Path, effect: str, taps: int) -> None:
    """Write a file per tap and finger, and their labels.

    The effect is that of the `material` and the object, or that of the `object` only.
    """
    rows = ["object,tap,finger,material"]
    for number, (name, (material, level_db)) in enumerate(OBJECTS.items()):
        for tap in range(1, taps + 1):
            for finger in range(4):
                amplitudes = {TONES_HZ[0]: 0.3, TONES_HZ[2]: 0.03 * 10 ** (level_db / 20)}
                if effect == "material":
                    amplitudes[TONES_HZ[3] if material == "wood" else 7000.0] = 0.3
                sound = tones(amplitudes, [number, tap, finger])
                write_wav(folder / "audio" / name / f"{tap}_{finger}.wav", sound, 44_100)
                rows.append(f"{name},{tap},{finger},{material}")
    (folder / "labels.csv").write_text("\n".join(rows))


#: Frequency of the robot's noise, which is also the tone of the contact `scrape`.
NOISE_HZ = TONES_HZ[1]
CONTACTS = {"tap": TONES_HZ[0], "scrape": NOISE_HZ}
#: Sign of the second microphone in each demonstration.
SIGNS = {"demo_1": 1, "demo_2": -1, "demo_3": -1}
START_S = 1769522137.5
LATENCY_S = 0.25


def write_demonstrations(folder: Path, noise: float = 0.0, seed: int = 0) -> None:
    """Write a long file with two channels per demonstration, its contacts, and the robot's poses.

    A contact takes 0.1 s; the next one follows at once. A sound is `LATENCY_S` later than its pose.
    `noise` is the level of the robot's noise.
    """
    contacts = ["file,start,end,demo,contact,time"]
    poses = ["stamp,z_m"]
    for number, (demo, sign) in enumerate(SIGNS.items()):
        parts = []
        for event in range(12):
            contact = ("tap", "scrape")[event % 2]
            sound = tones({CONTACTS[contact]: 0.1}, [seed, number, event], 0.1)
            if noise:
                sound += tones({NOISE_HZ: noise}, [seed, number, event, 1], 0.1)
            parts.append(sound)
            start_s = 0.1 * event
            time_s = START_S + 100 * number + start_s
            contacts.append(
                f"{demo}.wav,{start_s:.1f},{start_s + 0.1:.1f},{demo},{contact},{time_s:.2f}"
            )
            poses.append(f"{time_s - LATENCY_S:.2f},{0.01 * event:.2f}")
        first = np.round(np.concatenate(parts) * 2**15) / 2**15  # exact in 16 bits
        write_wav(folder / f"{demo}.wav", np.stack([first, sign * first], axis=1), RATE_HZ)
    (folder / "contacts.csv").write_text("\n".join(contacts))
    (folder / "robot.csv").write_text("\n".join(poses))
