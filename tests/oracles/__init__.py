"""Independent float64 references written from the definitions. Nothing here imports gtao."""
