"""One bit of a recording, of a published data set or of a kept response changes: it is named, or
what is read is the same."""

import numpy as np
import pytest
from forked import Forked
from tally import trials

from ajgdata.gripper import ImpulseResponse, Scene
from ajgdata.paths import Paths, Tree
from ajgdata.store import manifest
from ajgdata.store.publishing.checks import defects
from ajgdata.store.responses import ResponseStore, read_response
from ajgdata.types import DataError

pytestmark = pytest.mark.torture
PROMISE = "One flipped bit is named, or changes nothing that is read"
FOUND, SAME = 10, 0


def tree(path):
    """A published tree without its defects, which are raised."""
    found = defects(Tree(next(p for p in path.parents if p.name == "knock")))
    if found:
        raise DataError(path, str(found[0]), "publish it again")


def of_session(path):
    """What the manifests of its session would be: of a changed file it is a finding."""
    root = next(p for p in path.parents if p.name == "trial")
    (session,) = {p.name for p in (root / "data/knock/sessions").iterdir() if p.name[0] != "."}
    held = manifest.contents(Paths(root), "knock", session, manifest.HashCache(root / "none"))
    found = held[Paths(root).audio_manifest("knock", session)].decode()
    if "sha256 differs" in found:
        raise DataError(path, "changed", "restore it")
    return found


def response(path):
    """A kept response; one that is not used is simulated again."""
    found = read_response(path)
    if found is None:
        raise DataError(path, "is damaged", "it is simulated again")
    return found.samples.tobytes(), found.sample_rate_hz, found.provenance


def keep_response(root):
    """Keep a response, as the session of a virtual gripper does."""
    heard = np.random.default_rng(0).standard_normal(300)
    made = ImpulseResponse(heard, 1 / 3, 44_100, 17, {"note": "é"}, 0.3, None)
    ResponseStore(Paths(root).responses).write(Scene.model_validate({"grasp": {"seed": 0}}), made)


KINDS = {
    "recording (WAV)": ("data/knock/sessions/*/audio/**/*.wav", of_session),
    "kept response": (".ajgdata/responses/*/*.npz", response),
    "published tree": ("results/published/knock/**/*.*", tree),
}


@pytest.mark.parametrize("kind", KINDS)
def test_one_flipped_bit(deeds, place, tally, kind):
    pattern, read = KINDS[kind]
    root = place(deeds["publish"].end)
    keep_response(root)
    files = sorted(p for p in root.glob(pattern) if p.is_file())
    assert files, pattern
    for random in trials(f"flip {kind}", 30):
        path = random.choice(files)
        whole, before = path.read_bytes(), read(path)
        at = random.randrange(len(whole))
        changed = bytearray(whole)
        changed[at] ^= 1 << random.randrange(8)
        path.write_bytes(changed)

        def look(_, path=path, before=before):
            try:
                raise SystemExit(SAME if read(path) == before else 1)
            except DataError as error:
                print(error)
                raise SystemExit(FOUND) from None

        ended = Forked(look, root).ended(within_s=60)
        path.write_bytes(whole)
        name = path.relative_to(root).as_posix()
        wrong = "" if ended.code in (FOUND, SAME) else f"byte {at} of {name}: {ended}"
        tally.add(PROMISE, kind, wrong)
    assert not [one for one in tally.failures if f"; {kind}: " in one]
