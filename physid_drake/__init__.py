"""physid_drake: identify what a pushed object is made of, with Drake in the loop."""
