"""An independent planar reference for the Drake cell: no physid_drake, no pydrake."""
