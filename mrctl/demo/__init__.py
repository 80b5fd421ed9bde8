"""The demonstration: one road, one law, several ways from wished force to current, side by side."""
