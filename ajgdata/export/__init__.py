"""Trained models as ONNX files for computers without this package."""
