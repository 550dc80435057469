"""Report: results become figures and HTML pages that need no network.

This package opens no file of the workflow: it gets values.
"""
