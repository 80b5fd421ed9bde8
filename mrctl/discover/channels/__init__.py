"""What the file does to the signals, found and taken out: clocks, steps, zeros, scales, pasts."""
