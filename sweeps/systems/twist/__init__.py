"""A thrown racket: how far it twists while its handle comes round once."""
