"""Fits and their proof: the base, its tangent, one effect more, the data left out."""
