"""Experiments on tasks and embeddings.

`built_in` lists the experiments of this package. The module with the name of an experiment measures
and draws it; `base` has the protocol. `requests` and what it imports are light: Snakemake imports
them.
"""
