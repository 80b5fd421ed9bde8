"""Noise, in what is measured and in what a model leaves: by cycles, by spectra, of the motion."""
