"""Drawing halves of experiments whose modules would be too long with them; imported to draw."""
