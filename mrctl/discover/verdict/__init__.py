"""The verdict on what was found: its worth, its rivals, what is left, and the next run."""
