"""The carrier of CAN: joins a link with a foreign node on a bus."""
