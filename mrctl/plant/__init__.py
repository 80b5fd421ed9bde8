"""Simulated things to control: damper with coil lag and heat, quarter cars, roads."""
