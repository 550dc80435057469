"""Contrastive embeddings: recordings of one thing lie together, however it was grasped."""
