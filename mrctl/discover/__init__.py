"""Model against measurements: how good, where it fails, what is missing."""
