"""Commands of `polhode`, by what they take. Heavy modules are imported only when a command runs."""
