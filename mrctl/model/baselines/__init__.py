"""Current maps and models that others use: what this project's inverse is measured against."""
