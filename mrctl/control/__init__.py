"""Control laws: pure functions from the motion of a corner to a desired damper force."""
