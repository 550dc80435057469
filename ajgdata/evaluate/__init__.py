"""Evaluation: splits that keep groups whole, metrics, cross-validation. Imports are left to you."""
