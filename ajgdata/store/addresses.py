"""Addresses in messages and files, without passwords and signatures."""

from __future__ import annotations

import re


def without_credentials(text: str) -> str:
    """Return a text, or an address, whose addresses have neither user and password nor a query.

    >>> without_credentials("git+https://anna:secret@example.org/d?time=1:2&sig=secret: not found")
    'git+https://example.org/d: not found'
    """
    text = re.sub(r"://[^\s/]*@", "://", text)
    return re.sub(r"\?[^\s'\")]*[^\s'\"):;,.]", "", text)
