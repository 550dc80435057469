"""`ajgdata browse`: the recordings of a data set on a local page, to see, hear and correct them."""
