"""Who names whom: files, the symbols that they declare, and every place where one is used."""
