"""The parts of the page *Validation*, one module per kind of record: each turns its numbers into markdown."""
