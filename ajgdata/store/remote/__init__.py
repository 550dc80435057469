"""Published data sets at other places: download from an address, and upload to a repository."""
