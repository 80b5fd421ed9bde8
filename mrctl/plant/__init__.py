"""The simulated vehicle: road, quarter cars and virtual dampers, off line or on the bus."""
