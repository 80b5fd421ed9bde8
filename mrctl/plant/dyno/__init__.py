"""A virtual dyno: a damper with physics of its own on a test bench, for campaigns without a bench."""
