"""Three-way merge of charts by meaning: not by lines of text."""
