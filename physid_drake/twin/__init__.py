"""The twin: a compiled planar image of the cell, for searches and fits; the cell is the judge of what they find."""
