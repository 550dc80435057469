"""Upload of a published folder to a data set repository of Hugging Face.

The library reads the token of `hf auth login` or of HF_TOKEN; ajgdata neither prints nor stores it.
If an upload is interrupted, the library sends only the missing files in the next call.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ajgdata.store.remote.download import RUN_AGAIN
from ajgdata.store.remote.origins import HUB_PREFIX
from ajgdata.types import DataError, many
from ajgdata.types.extras import optional_packages

if TYPE_CHECKING:
    from huggingface_hub.hf_api import RepoFile

#: Folders whose files in the repository are removed if the published folder lacks them.
REPLACED_FOLDERS = ("audio/*", "figures/*", "models/*", "sessions/*")


def check_login(repository: str) -> None:
    """Raise DataError without the token of a login."""
    with optional_packages(f"--to {HUB_PREFIX}{repository}"):
        from huggingface_hub import get_token  # takes 0.3 s; most commands do not need it
    if not get_token():
        fix = "run `hf auth login`, or set HF_TOKEN to a token that may write"
        raise DataError(f"{HUB_PREFIX}{repository}", "there is no token of Hugging Face", fix)


def is_private(repository: str) -> bool | None:
    """Return whether a repository is private; None if it does not exist.

    Raises DataError if the request fails.
    """
    from huggingface_hub import HfApi
    from huggingface_hub.utils import RepositoryNotFoundError

    try:
        return bool(HfApi().dataset_info(repository).private)
    except RepositoryNotFoundError:
        return None
    except Exception as error:  # the library of HTTP differs between versions of the hub's
        problem = f"cannot be reached ({' '.join(str(error).split())[:300]})"
        raise DataError(f"{HUB_PREFIX}{repository}", problem, RUN_AGAIN) from None


def upload(repository: str, files: Mapping[str, Path], folder: Path, version: str) -> bool:
    """Make a repository equal to a published `folder`, and return whether it is private.

    A new repository is private. `files` are all files of the folder by name; `version` is that of
    the data set. Raises DataError if a request fails, or if a file in the repository has other
    bytes.
    """
    from huggingface_hub import HfApi
    from huggingface_hub.hf_api import RepoFile

    api = HfApi()
    try:
        api.create_repo(repository, repo_type="dataset", private=True, exist_ok=True)
        commit = api.upload_folder(
            repo_id=repository,
            folder_path=folder,
            repo_type="dataset",
            commit_message=f"Version {version}",
            delete_patterns=list(REPLACED_FOLDERS),
        )
        tree = api.list_repo_tree(
            repository, recursive=True, revision=commit.oid, repo_type="dataset"
        )
        stored = {file.path: file for file in tree if isinstance(file, RepoFile)}
        has_private_files = bool(api.dataset_info(repository).private)
    except Exception as error:  # the library of HTTP differs between versions of the hub's
        problem = f"the upload failed ({' '.join(str(error).split())[:300]})"
        raise DataError(f"{HUB_PREFIX}{repository}", problem, RUN_AGAIN) from None
    wrong = [
        name
        for name, path in files.items()
        if name not in stored or not _is_equal(stored[name], path)
    ]
    if wrong:
        differ = "differs" if len(wrong) == 1 else "differ"
        problem = f"{many(len(wrong), 'file')} {differ} after the upload, first {wrong[0]}"
        raise DataError(f"{HUB_PREFIX}{repository}", problem, RUN_AGAIN)
    return has_private_files


def _is_equal(stored: RepoFile, path: Path) -> bool:
    """Return whether a file of a repository has the bytes of a local file.

    The repository states the sha256 of large files, and git's hash of all other files.
    """
    if stored.lfs is not None:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest() == stored.lfs.sha256
    content = path.read_bytes()
    blob = b"blob %d\0%s" % (len(content), content)
    return hashlib.sha1(blob, usedforsecurity=False).hexdigest() == stored.blob_id
