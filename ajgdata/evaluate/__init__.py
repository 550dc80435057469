"""Evaluation of models on arrays: folds, cross-validation, metrics, intervals and verdicts."""
