"""A small project on disk: the world that readers and feature files see."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from ajgdata.paths import Paths
from ajgdata.pipeline.feature_file import build_feature_file
from ajgdata.store.audio import write_pcm24
from ajgdata.store.code_hash import features_code
from ajgdata.store.features import FeatureRows, read_store
from ajgdata.store.findings import read_findings
from ajgdata.store.sessions import write_session
from ajgdata.types import (
    AudioSettings,
    Excitation,
    FeatureSettings,
    Finding,
    Recording,
    Session,
    Target,
)

RATE_HZ = 8_000
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
FEATURES = FeatureSettings(window=256, hop=128)


def tone(hz: float, samples: int = 2_000) -> np.ndarray:
    """A sine of half the full scale, with nothing random in it."""
    return 0.5 * np.sin(2 * np.pi * hz * np.arange(samples) / RATE_HZ)


def write_tone(path: Path, hz: float, samples: int = 2_000) -> str:
    """A recording of `tone`; returns its hash."""
    write_pcm24(path, tone(hz, samples), RATE_HZ)
    return hashlib.sha256(path.read_bytes()).hexdigest()


def assert_one_line(error: str, text: str) -> None:
    """Check that a command printed one line with `text` and no traceback."""
    assert error.startswith("error ")
    assert text in error
    assert error.count("\n") == 1
    assert "Traceback" not in error


@dataclass
class Project:
    """A project folder with one data set, `d`."""

    paths: Paths

    @property
    def root(self) -> Path:
        return self.paths.root

    def declare(self, **keys: object) -> Path:
        path = self.paths.dataset("d")
        path.parent.mkdir(parents=True, exist_ok=True)
        content = {
            "name": "d",
            "audio": {"sample_rate_hz": RATE_HZ},
            "features": {"window": 256, "hop": 128},
            "targets": {"edge_mm": {"kind": "regression", "unit": "mm"}},
        }
        path.write_text(yaml.safe_dump(content | keys, sort_keys=False))
        return path

    def folder(self, session: str = "s1") -> Path:
        return self.paths.session("d", session)

    def session(
        self, session: str = "s1", tones: dict[str, float] | None = None, **keys: object
    ) -> list[Recording]:
        """A session whose recordings are tones; their label is the tone's number."""
        tones = {"a": 500.0, "b": 750.0, "c": 1000.0} if tones is None else tones
        rows = [
            Recording(
                recording_id=name,
                file=f"audio/{name}.wav",
                sha256=write_tone(self.folder(session) / "audio" / f"{name}.wav", hz),
                grasp_id=f"g_{name}",
                sample=number,
                object="box",
                labels={"edge_mm": str(hz)},
            )
            for number, (name, hz) in enumerate(tones.items())
        ]
        self.write(rows, session, **keys)
        return rows

    def write(self, rows: list[Recording], session: str = "s1", **keys: object) -> None:
        write_session(
            self.folder(session), Session(session_id=session, source="import", **keys), rows
        )

    def excitation(self, session: str, samples: np.ndarray) -> Excitation:
        path = self.folder(session) / "excitation.wav"
        write_pcm24(path, samples, RATE_HZ)
        return Excitation(file=path.name, sha256=hashlib.sha256(path.read_bytes()).hexdigest())

    def build(
        self,
        *sessions: str,
        audio: AudioSettings = AUDIO,
        features: FeatureSettings = FEATURES,
        targets: dict[str, Target] | None = None,
        code: str = "",
        threads: int = 1,
    ) -> tuple[int, int]:
        """Write the feature file of sessions (default: s1); returns (computed, reused)."""
        return build_feature_file(
            self.paths,
            dataset="d",
            sessions=sessions or ("s1",),
            audio=audio,
            features=features,
            targets=targets or {"edge_mm": Target(kind="regression", unit="mm")},
            code=code or features_code(features),
            store=self.paths.features("d"),
            quarantine=self.paths.quarantine("d"),
            hashes=self.paths.session_hashes("d"),
            threads=threads,
        )

    def store(self) -> FeatureRows:
        return read_store(self.paths.features("d"))

    def quarantine(self) -> list[Finding]:
        return read_findings(self.paths.quarantine("d"))
