"""A live view of a controller, from nothing but the bus."""
