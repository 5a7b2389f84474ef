"""Commands of `polhode`, by the kind of their first argument. Heavy modules are imported only when a command runs."""
