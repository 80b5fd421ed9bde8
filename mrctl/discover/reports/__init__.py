"""Figures, words and pages of comparisons, diagnoses, extensions and discoveries."""
