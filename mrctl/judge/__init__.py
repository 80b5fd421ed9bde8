"""The independent judge: watches a bus or a log and says which safety rule a command breaks.

It shares no code with the controller, only the DBC file, and knows nothing of how commands are made: cantools
reads the DBC, python-can the bus, and the rest is written here once more from the specifications.
"""
