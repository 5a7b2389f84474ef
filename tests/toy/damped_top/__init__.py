"""A system of equations that is no part of Polhode: a top whose spin a drag slows down."""
