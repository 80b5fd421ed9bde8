"""From dyno measurements to the numbers of a damper."""
