"""Maps on disk and in parts: points of a place, without a look at the rest of the map."""
