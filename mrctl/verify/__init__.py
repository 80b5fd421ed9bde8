"""The published tables beside what this project makes of the same protocol."""
