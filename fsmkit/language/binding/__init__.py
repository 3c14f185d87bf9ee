"""From text to the typed tree: names are looked up, and every node gets its type and location."""
