"""Path -> path adapters, one for each rule: read, call a pure function, write."""
