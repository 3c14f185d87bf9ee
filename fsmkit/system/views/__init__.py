"""Systems shown: drawn, and as a tree."""
