"""Drafts of deposits at Zenodo: a reserved DOI, files and their description.

Nothing is published: a person presses *Publish* on the page of the draft. Zenodo documents the
requests at https://developers.zenodo.org.
"""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import file_digest
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import requests
from requests.auth import AuthBase

from ajgdata.paths import Tree
from ajgdata.store.files import read_yaml
from ajgdata.store.remote.download import REQUEST_TIMEOUT_S, RUN_AGAIN
from ajgdata.types import DataError

#: Environment variable with the address of the server, e.g. that of the sandbox.
ENDPOINT_VARIABLE = "ZENODO_ENDPOINT"
DEFAULT_ENDPOINT = "https://zenodo.org"
TOKEN_VARIABLE = "ZENODO_TOKEN"
#: Longest time in s from the last byte of a file to the answer: Zenodo computes its checksum.
ANSWER_TIMEOUT_S = 600.0


@dataclass(frozen=True)
class ZenodoDraft:
    """A deposit that is not published: DOI, addresses of its files and of its page, and files.

    `files` are the MD5 hashes of complete files by name.
    """

    number: str
    doi: str
    bucket: str
    page: str
    files: Mapping[str, str]


@dataclass(frozen=True)
class _Bearer(AuthBase):
    """The token in the header of each request, also if ~/.netrc has a password for the server."""

    token: str = field(repr=False)

    def __call__(self, request: requests.PreparedRequest) -> requests.PreparedRequest:
        request.headers["Authorization"] = f"Bearer {self.token}"
        return request


class Zenodo:
    """Requests to the server of an account. The token is never printed or stored."""

    def __init__(self, endpoint: str, token: str) -> None:
        self.endpoint = endpoint
        self._auth = _Bearer(token)

    @classmethod
    def from_environment(cls) -> Zenodo:
        """Return the server and the account of the environment variables.

        Raises DataError without a token, and for an address that would send it unencrypted.
        """
        endpoint = os.environ.get(ENDPOINT_VARIABLE, DEFAULT_ENDPOINT).rstrip("/")
        parts = urlsplit(endpoint)
        if parts.scheme != "https" and not _is_this_computer(parts.hostname or ""):
            problem = f"{endpoint!r} does not begin with https://"
            raise DataError(ENDPOINT_VARIABLE, problem, "use https://sandbox.zenodo.org for tests")
        token = os.environ.get(TOKEN_VARIABLE, "").strip()
        if not token:
            page = f"{endpoint}/account/settings/applications"
            fix = f"create a token with the scope deposit:write at {page}, and export it"
            raise DataError(TOKEN_VARIABLE, "is not set", fix)
        return cls(endpoint, token)

    def reserve(self) -> ZenodoDraft:
        """Create an empty draft, which reserves a DOI."""
        url = f"{self.endpoint}/api/deposit/depositions"
        return self._draft(url, self._request("POST", url, json={}))

    def draft(self, doi: str) -> ZenodoDraft:
        """Return the draft with a reserved DOI.

        Raises DataError if the DOI is not of Zenodo, if the account has no such draft, and if it is
        published.
        """
        match = re.fullmatch(r"10\.\d+/zenodo\.(\d+)", doi)
        if not match:
            fix = "remove `doi` from dataset.yaml, so that a new one is reserved"
            raise DataError(f"doi {doi}", "is not of Zenodo", fix)
        url = f"{self.endpoint}/api/deposit/depositions/{match[1]}"
        content = self._request("GET", url)
        if content.get("submitted"):
            fix = (
                "press New version on its page, and set `version` and the `doi` of the new draft "
                "in dataset.yaml"
            )
            raise DataError(f"doi {doi}", "is published, and a published record cannot change", fix)
        return self._draft(url, content)

    def describe(self, draft: ZenodoDraft, metadata: Mapping[str, Any]) -> None:
        """Write the description of a draft, and replace an earlier one."""
        url = f"{self.endpoint}/api/deposit/depositions/{draft.number}"
        self._request("PUT", url, json={"metadata": metadata})

    def send(self, draft: ZenodoDraft, name: str, path: Path) -> None:
        """Write a file into a draft, unless it is there already.

        Raises DataError if the MD5 that the server computed is not that of the file.
        """
        with path.open("rb") as stream:
            expected = file_digest(stream, "md5").hexdigest()
            if draft.files.get(name) == expected:
                return
            stream.seek(0)
            answer = self._request("PUT", f"{draft.bucket}/{quote(name)}", data=stream)
        if str(answer.get("checksum", "")).removeprefix("md5:") != expected:
            problem = f"the server has other bytes of {name} (MD5 differs)"
            raise DataError(draft.page, problem, RUN_AGAIN)

    def _draft(self, url: str, content: Mapping[str, Any]) -> ZenodoDraft:
        """Return the draft in an answer of the server. Raises DataError for another answer."""
        try:
            links = content["links"]
            draft = ZenodoDraft(
                number=str(content["id"]),
                doi=content["metadata"]["prereserve_doi"]["doi"],
                bucket=links["bucket"],
                page=links["html"],
                files={
                    file["filename"]: str(file["checksum"]).removeprefix("md5:")
                    for file in content.get("files", ())
                },
            )
        except (LookupError, TypeError) as error:
            raise DataError(url, f"has an unexpected answer (lacks {error})", RUN_AGAIN) from None
        if not draft.bucket.startswith(f"{self.endpoint}/"):
            fix = f"set {ENDPOINT_VARIABLE} to the address of that server"
            raise DataError(url, f"names another server for the files ({draft.bucket})", fix)
        return draft

    def _request(self, method: str, url: str, **content: Any) -> dict[str, Any]:
        """Return the JSON answer to a request. Raises DataError if it fails or is not an object."""
        timeout = (REQUEST_TIMEOUT_S, ANSWER_TIMEOUT_S)
        try:
            response = requests.request(
                method, url, auth=self._auth, timeout=timeout, allow_redirects=False, **content
            )
            answer = response.json() if response.content else {}
        except requests.JSONDecodeError:
            answer = {}
        except requests.RequestException as error:
            problem = f"cannot be reached ({' '.join(str(error).split())[:200]})"
            raise DataError(url, problem, RUN_AGAIN) from None
        if response.status_code in (401, 403):
            fix = f"create one with the scope deposit:write at {self.endpoint}"
            raise DataError(TOKEN_VARIABLE, f"is refused for {url} ({response.status_code})", fix)
        if response.status_code == 404:
            fix = "use the account that reserved this DOI, or remove `doi` from dataset.yaml"
            raise DataError(url, "there is no such draft in this account", fix)
        if not response.ok or response.is_redirect or not isinstance(answer, dict):
            reason = answer.get("message", "") if isinstance(answer, dict) else ""
            details = " ".join(str(reason).split())[:200] or "it gives no reason"
            raise DataError(url, f"answers {response.status_code} ({details})", RUN_AGAIN)
        return answer


def _is_this_computer(host: str) -> bool:
    """Return whether the name of a server is this computer."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def deposit_metadata(tree: Tree) -> dict[str, Any]:
    """Return the description of the deposit of a published folder, from its CITATION.cff."""
    about = read_yaml(tree / Tree.CITATION)
    paragraphs = [text for text in str(about["abstract"]).split("\n\n") if text.strip()]
    metadata = {
        "upload_type": "dataset",
        "title": about["title"],
        "creators": about["authors"],
        "description": "".join(f"<p>{escape(text)}</p>" for text in paragraphs),
        "access_right": "open",
        "license": str(about["license"]).lower(),
        "version": about["version"],
        "keywords": about["keywords"],
        "prereserve_doi": True,
    }
    if about.get("date-released"):
        metadata["publication_date"] = str(about["date-released"])
    return metadata
