"""Lane-level mathematics. Modules here know ``math`` and Dr.Jit only; array types come in with the arrays."""
