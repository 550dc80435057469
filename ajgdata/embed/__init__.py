"""Contrastive embeddings: recordings of one object are near each other, also in other grasps."""
