"""What an editor requests, one file a feature: pure functions of the index and a place."""
