"""The `ajgdata` command."""

from ajgdata.cli.main import app, main

__all__ = ["app", "main"]
