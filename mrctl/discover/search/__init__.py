"""The search over effects: looks at all candidates, rounds, levels."""
