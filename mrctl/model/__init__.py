"""Scalar physics of the damper: tables, filters, forward and inverse model. No I/O and no clock."""
