"""A system of equations that is no part of Polhode: a top with a spin that a drag slows down."""
