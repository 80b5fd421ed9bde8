"""The CAN side: database, frame codec, end-to-end protection, buses, bus load."""
