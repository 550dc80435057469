"""Figures of README and docs that a run computes, written from its results (`make findings`).

A document holds `<!-- findings: NAME -->` … `<!-- /findings -->`; what is between them is made by
the function of that name in `blocks`, and nothing else of the document is touched.
"""
