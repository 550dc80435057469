"""Every set that can be fetched by name: its file names as its makers wrote them give sessions and
labels."""

from collections import Counter
from pathlib import Path

import pytest

from ajgdata.paths import Paths
from ajgdata.store.scan import scan
from ajgdata.store.sessions import read_dataset
from ajgdata.store.sources import list_sources, read_source

PATHS = Paths(Path(__file__).resolve().parents[2])
NAMES = list_sources(PATHS)
KIT = "acoustic_sensing_starter_kit-master/lndw2022_sweep_1s"
FINGER = "data/20251102_exploration_sweep_1s_finger"
REGRESSION = "with_stand_sweep_regression_newmethod_finger"
PLACES = f"data/20260119_{REGRESSION}_030"
BATCH = "acoustic_sensing_starter_kit/data/soft_finger_batch"
SCAN = "acoustic_sensing_starter_kit/data/collected_data_runs"

#: Of each set: a few of its files as its makers name them, the sessions that come of it, and labels
#: that they must give.
LAYOUTS = {
    "active_rp": (
        [f"{KIT}/{name}" for name in ("0_sweep.wav", "1_desk.wav", "2_metal.wav")],
        {"session1": 2, "session2": 2},
        "label",
        {"desk", "metal"},
    ),
    "esc10": (
        ["001 - Dog bark/1-100032-A.ogg", "010 - Fire crackling/5-17808-B.ogg"],
        {"esc10": 2},
        "label",
        {"Dog bark", "Fire crackling"},
    ),
    "knock_material": (
        [
            "Data/processed/train/Wood/1.wav",
            "Data/processed/test/Marble/100.wav",
            "Data/raw/Wood/1.wav",
        ],
        {"knock_material": 2},
        "material",
        {"Wood", "Marble"},
    ),
    "stone_impact": (
        ["audio/0_raw_sound/S01_1_ini.wav", "audio/0_raw_sound/S25_2_ini.wav"],
        {"stone_impact": 2},
        "form",
        {"pl", "pt"},
    ),
    "soft_finger_contact": (
        [f"{FINGER}_029/0_sweep.wav", f"{FINGER}_029/100_none.wav", f"{FINGER}_032/17_tip.wav"],
        {"finger_029_no_stand": 1, "finger_032_no_stand": 1},
        "contact",
        {"none", "tip"},
    ),
    "soft_finger_position": (
        [
            f"{PLACES}/0_sweep.wav",
            f"{PLACES}/1_none.wav",
            f"data/20260117_{REGRESSION}_037/17_7.5.wav",
        ],
        {"finger_030": 1, "finger_037": 1},
        "position",
        {"none", "7.5"},
    ),
    "soft_finger_touch": (
        [
            f"{BATCH}_1/data/10_finger blank.wav",
            f"{BATCH}_1/data/1_finger tip.wav",
            f"{BATCH}_2/data/0_long_sweep.wav",
            f"{BATCH}_2/data/32_finger bottom.wav",
        ],
        {"batch_1": 2, "batch_2": 1},
        "contact",
        {"blank", "tip", "bottom"},
    ),
    "franka_contact": (
        [
            f"{SCAN}_2026_01_15_workspace_1_pure_no_contact/data/1_no_contact.wav",
            f"{SCAN}_2026_01_14_workspace_3_pure_contact_relabeled/data/27_contact.wav",
            f"{SCAN}_2026_01_14_workspace_3_pure_contact_relabeled/data/27_edge.wav",
        ],
        {"workspace_1_empty": 1, "workspace_3_blank": 2},
        "contact",
        {"no_contact", "edge", "contact"},
    ),
    "franka_new_object": (
        [
            f"{SCAN}_2026_01_27_hold_out_dataset_relabeled/data/1022_edge.wav",
            f"{SCAN}_2026_01_27_hold_out_dataset_relabeled/data/1022_contact.wav",
        ],
        {"workspace_4_square": 2},
        "contact",
        {"edge", "contact"},
    ),
}
STONES = (
    "sound_sample_name_simple,sample_name,form,mass_ini,f1_ini\n"
    "S01_1,S01,pl,1500.5,900.1\nS25_2,S25,pt,0.00,0.00\n"
)


@pytest.mark.parametrize("name", NAMES)
def test_a_source_says_what_a_declaration_does_not(name):
    source = read_source(PATHS, name)
    spec = read_dataset(PATHS, name)
    assert spec.url == source.origin.repository
    assert spec.licence != "not stated"  # one of the known ones, or that there is none
    assert source.republish == (spec.licence != "none stated")
    assert spec.recipe is None
    assert spec.tasks
    assert spec.imports.pattern or spec.imports.table


@pytest.mark.parametrize("name", NAMES)
def test_its_files_give_sessions_and_labels(name, tmp_path):
    files, sessions, column, labels = LAYOUTS[name]
    source = read_source(PATHS, name)
    spec = read_dataset(PATHS, name)
    folder = tmp_path / name
    for part in source.origin.parts:
        for file in files:
            if file.startswith(part.folder):
                path = folder / part.into / Path(file).relative_to(part.folder)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.touch()
    for data in folder.glob("*/data") if name.startswith("franka") else ():
        rows = [f"./data/{path.name},{n}" for n, path in enumerate(data.iterdir())]
        (data.parent / "sweep.csv").write_text("\n".join(["acoustic_filename,point_index", *rows]))
    if name == "stone_impact":
        (folder / "data").mkdir()
        (folder / "data/data_ini.csv").write_text(STONES)
    listing = scan(folder, spec.imports, name)
    assert not listing.remarks["failed"]
    assert Counter(entry.session for entry in listing.files) == sessions
    assert {entry.labels[column] for entry in listing.files} == labels
    for entry in listing.files:
        assert set(spec.targets) <= {"object", *entry.labels}
        assert {task.groups for task in spec.tasks.values()} <= {
            "grasp_id",
            "session_id",
            *entry.labels,
        }
